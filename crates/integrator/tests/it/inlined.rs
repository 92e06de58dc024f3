//! Whether what is compiled for lanes is compiled into one piece.

/// Instructions that other crates call, which read image files and are not optimised here.
#[cfg(target_arch = "x86_64")]
const OF_OTHERS: [&str; 6] = ["_add_ps", "_sub_ps", "_mul_ps", "_set1_", "_loadu_", "_storeu_"];

/// Instructions of lanes are functions to the compiler, and are inlined only into code that is
/// compiled for the same instructions. A closure in a kernel is not, unless it is inlined itself:
/// what it does then takes ten times as long, and nothing else tells. So this program, which has
/// the kernels of all crates that render, has none of these functions by name, but for those that
/// other crates call. (Seen to fail where a closure draws the random numbers of eight vertices.)
#[test]
#[cfg(target_arch = "x86_64")]
fn instructions_of_lanes_are_inlined() {
    let program = std::fs::read(std::env::current_exe().unwrap()).unwrap();
    let names = |what: &str| -> Vec<String> {
        let mut found = Vec::new();
        let starts = program.windows(what.len()).enumerate();
        for (start, _) in starts.filter(|(_, window)| *window == what.as_bytes()) {
            let name = program[start..].iter().take_while(|byte| byte.is_ascii_graphic());
            found.push(name.map(|&byte| char::from(byte)).collect());
        }
        found.sort();
        found.dedup();
        found
    };
    // Parts of names as symbols have them, put together here: this program's text is in it, too.
    if names(&["8run", "avx2"].join("_")).is_empty() {
        println!("SKIPPED instructions_of_lanes_are_inlined: the program has no symbols");
        return;
    }
    for set in ["3avx", "4avx2", "7avx512f", "8avx512vl"] {
        let mut outside = names(&["core", &format!("arch3x86{set}")].join("_"));
        outside.retain(|name| !OF_OTHERS.iter().any(|of_others| name.contains(of_others)));
        assert!(outside.is_empty(), "not inlined: {outside:#?}");
    }
}
