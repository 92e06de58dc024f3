(function () {
'use strict';
var COLOURS = ['#1b6ca8', '#c0392b', '#2e8b57', '#8e44ad', '#d68910', '#34495e', '#7f8c8d'];
var all = function (root, what) { return Array.from(root.querySelectorAll(what)); };

// Sliders show more of one image or of the other.
all(document, '.pair').forEach(function (pair) {
  var over = pair.querySelector('.over'), slide = pair.querySelector('input');
  slide.addEventListener('input', function () {
    over.style.clipPath = 'inset(0 ' + (100 - slide.value) + '% 0 0)';
  });
});

// A click on a heading sorts the table by its column, a second one the other way round; missing
// values come last.
all(document, 'table.sortable').forEach(function (table) {
  var body = table.tBodies[0];
  all(table, 'th button').forEach(function (button) {
    var column = button.parentNode.cellIndex, sign = -Number(button.dataset.sign);
    button.addEventListener('click', function () {
      sign = -sign;
      var value = function (row) { return row.cells[column].dataset.value; };
      Array.from(body.rows).sort(function (a, b) {
        var x = value(a), y = value(b);
        if (x === '' || y === '') { return (x === '') - (y === ''); }
        return sign * (Number(x) - Number(y));
      }).forEach(function (row) { body.appendChild(row); });
    });
  });
});

// The error of one pixel over time, for every method.
function curves(section) {
  var box = section.querySelector('.pixel');
  if (!box) { return function () {}; }
  var data = JSON.parse(box.querySelector('script').textContent);
  var bytes = data.data.map(function (text) {
    return Uint8Array.from(atob(text), function (c) { return c.charCodeAt(0); });
  });
  var svg = box.querySelector('svg'), name = box.querySelector('.where');
  var make = function (kind, attributes, text) {
    var node = document.createElementNS('http://www.w3.org/2000/svg', kind);
    Object.keys(attributes).forEach(function (key) { node.setAttribute(key, attributes[key]); });
    if (text !== undefined) { node.textContent = text; }
    svg.appendChild(node);
  };
  var count = data.width * data.height;
  var times = [].concat.apply([], data.seconds).map(Math.log10);
  var low = Math.min.apply(null, times), high = Math.max(low + 0.1, Math.max.apply(null, times));
  var x = function (seconds) { return 60 + 450 * (Math.log10(seconds) - low) / (high - low); };
  var y = function (exponent) { return 20 + 230 * (data.high - exponent) / (data.high - data.low); };
  return function (u, v) {
    var column = Math.min(data.width - 1, Math.floor(u / 100 * data.width));
    var row = Math.min(data.height - 1, Math.floor(v / 100 * data.height));
    var place = row * data.width + column;
    svg.replaceChildren();
    for (var e = data.low; e <= data.high; e += 1) {
      make('path', {d: 'M60 ' + y(e) + 'H510', stroke: '#ddd'});
      make('text', {x: 54, y: y(e) + 4, 'text-anchor': 'end'}, '1e' + e);
    }
    for (var d = Math.ceil(low); d <= high; d += 1) {
      make('path', {d: 'M' + x(Math.pow(10, d)) + ' 20V250', stroke: '#ddd'});
      make('text', {x: x(Math.pow(10, d)), y: 268, 'text-anchor': 'middle'}, String(Number(Math.pow(10, d).toPrecision(3))));
    }
    make('path', {d: 'M60 20V250H510', fill: 'none', stroke: '#333'});
    make('text', {x: 285, y: 290, 'text-anchor': 'middle'}, 'CPU seconds');
    data.names.forEach(function (method, m) {
      var points = data.seconds[m].map(function (seconds, t) {
        var exponent = data.low + bytes[m][t * count + place] / 255 * (data.high - data.low);
        return x(seconds).toFixed(1) + ',' + y(exponent).toFixed(1);
      });
      var colour = COLOURS[m % COLOURS.length];
      make('polyline', {points: points.join(' '), fill: 'none', stroke: colour, 'stroke-width': 2});
      make('text', {x: 520, y: 30 + 18 * m, fill: colour}, method);
    });
    var side = data.block === 1 ? 'pixel' : data.block + ' x ' + data.block + ' pixels at';
    name.textContent = side + ' (' + column * data.block + ', ' + row * data.block + ')';
    box.hidden = false;
  };
}

// Zoom and pan, the same for all images of a scene.
all(document, 'section').forEach(function (section, number) {
  var s = 1, x = 0, y = 0, views = all(section, '.view'), show = curves(section);
  var key = 'lightshed-' + number;
  var keep = function (u, v) {
    try { sessionStorage.setItem(key, JSON.stringify([s, x, y, u, v])); } catch (error) { return; }
  };
  var picked = [];
  var apply = function () {
    s = Math.min(64, Math.max(1, s));
    x = Math.min(0, Math.max(100 * (1 - s), x));
    y = Math.min(0, Math.max(100 * (1 - s), y));
    section.style.setProperty('--s', s);
    section.style.setProperty('--x', x);
    section.style.setProperty('--y', y);
    section.classList.toggle('zoomed', s > 1);
    keep(picked[0], picked[1]);
  };
  // The point (u, v) of the view, in per cent, stays where it is.
  var zoom = function (factor, u, v) {
    var next = Math.min(64, Math.max(1, s * factor));
    x = u - (u - x) * next / s;
    y = v - (v - y) * next / s;
    s = next;
    apply();
  };
  var pick = function (u, v) {
    if (!(u >= 0 && u < 100 && v >= 0 && v < 100)) { return; }
    picked = [u, v];
    section.style.setProperty('--u', u);
    section.style.setProperty('--v', v);
    section.classList.add('picked');
    show(u, v);
    keep(u, v);
  };
  all(section, '.tools button').forEach(function (button) {
    button.addEventListener('click', function () { zoom(Number(button.dataset.factor), 50, 50); });
  });
  views.forEach(function (view) {
    var mark = document.createElement('i'), down = {}, moved = 0, gap = 0;
    mark.className = 'mark';
    view.appendChild(mark);
    var at = function (event) {
      var box = view.getBoundingClientRect();
      return [(event.clientX - box.left) / box.width * 100, (event.clientY - box.top) / box.height * 100];
    };
    view.addEventListener('wheel', function (event) {
      if (!event.ctrlKey && !event.metaKey) { return; }
      event.preventDefault();
      var p = at(event);
      zoom(Math.pow(2, -event.deltaY / 200), p[0], p[1]);
    }, {passive: false});
    view.addEventListener('dblclick', function (event) {
      var p = at(event);
      zoom(2, p[0], p[1]);
    });
    view.addEventListener('pointerdown', function (event) {
      if (Object.keys(down).length === 0) { moved = 0; gap = 0; }
      down[event.pointerId] = at(event);
      if (s > 1) { view.setPointerCapture(event.pointerId); }
    });
    view.addEventListener('pointermove', function (event) {
      var before = down[event.pointerId];
      if (!before) { return; }
      var p = at(event), ids = Object.keys(down);
      down[event.pointerId] = p;
      moved += Math.abs(p[0] - before[0]) + Math.abs(p[1] - before[1]);
      if (ids.length === 2) {
        var a = down[ids[0]], b = down[ids[1]], now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (gap > 0 && now > 0) { zoom(now / gap, (a[0] + b[0]) / 2, (a[1] + b[1]) / 2); }
        gap = now;
      } else if (s > 1) {
        x += p[0] - before[0];
        y += p[1] - before[1];
        apply();
      }
    });
    view.addEventListener('pointerup', function (event) {
      if (down[event.pointerId] && Object.keys(down).length === 1 && moved < 2) {
        var p = at(event);
        pick((p[0] - x) / s, (p[1] - y) / s);
      }
    });
    ['pointerup', 'pointercancel', 'pointerleave'].forEach(function (kind) {
      view.addEventListener(kind, function (event) { delete down[event.pointerId]; gap = 0; });
    });
  });
  try {
    var kept = JSON.parse(sessionStorage.getItem(key));
    if (document.body.dataset.watch && kept) {
      s = kept[0]; x = kept[1]; y = kept[2];
      apply();
      pick(kept[3], kept[4]);
    }
  } catch (error) { s = 1; }
});

// Sequences play: all strips of a scene show the same frame. A hand on the slider stops them.
all(document, '.player').forEach(function (player) {
  var count = Number(player.dataset.frames), frame = 0, timer = 0;
  var button = player.querySelector('.play'), slide = player.querySelector('input');
  var show = function (next) {
    frame = next;
    slide.value = frame;
    player.style.setProperty('--frame', frame);
  };
  var play = function (on) {
    clearInterval(timer);
    timer = on ? setInterval(function () { show((frame + 1) % count); }, 150) : 0;
    button.textContent = on ? 'Pause' : 'Play';
  };
  button.addEventListener('click', function () { play(!timer); });
  slide.addEventListener('input', function () { play(false); show(Number(slide.value)); });
  play(!matchMedia('(prefers-reduced-motion: reduce)').matches);
});

// A page of a comparison that still runs loads itself again.
if (document.body.dataset.watch) {
  setTimeout(function () { location.reload(); }, 1000 * Number(document.body.dataset.watch));
}
})();
