# What the tests of all schedulers share; sourced.
set -euo pipefail

skip() {
    echo "SKIPPED: $*"
    exit 77
}

fail() {
    echo "FAILED: $*" >&2
    exit 1
}

# Writes a job folder: submit SYSTEM NAME
submit() {
    # shellcheck disable=SC2086
    "$programs/render" $arguments --shards "$shards" --out "$work/$2.exr" --submit "$1" >/dev/null
}

# The first process that renders shard $2 of the image $1, once it has worked for a while.
process_of() {
    local pid ticks
    for _ in $(seq 2400); do
        for pid in $(pgrep -f -- "render .*--out $work/$1.exr --shard $2/$shards" || true); do
            # Only the program itself, not a shell that mentions it, and in the middle: 0.3 seconds of processor time or more.
            [[ "$(readlink "/proc/$pid/exe" || true)" == "$programs/render" ]] || continue
            ticks=$(awk '{print $14 + $15}' "/proc/$pid/stat" 2>/dev/null || echo 0)
            if [[ "$ticks" -ge 30 ]]; then
                echo "$pid"
                return
            fi
        done
        sleep 0.05
    done
    fail "shard $2 of $1 was never rendered"
}

# Kills the process that renders shard $2 of the image $1, in the middle.
kill_shard() {
    local pid
    pid=$(process_of "$1" "$2")
    kill -KILL "$pid"
    echo "killed process $pid, shard $2"
}

# Merges, and compares with the image of one process.
check() {
    local folder="$work/$1.job"
    "$folder/merge.sh" --status || fail "not all shards of $1 are there"
    "$folder/merge.sh" >/dev/null
    cmp "$work/$1.exr" "$work/undisturbed.exr" || fail "the image by $1 has other bits"
    [[ "$(find "$work" -name "$1.shard-*.exr" | wc -l)" == "$shards" ]] || fail "there are files too many"
}
