//! What the analysis says of programs whose answers are known.

use super::decode::{Operation, decode};
use super::elf::Image;
use super::fixture::{self, image};
use super::graph::Graph;
use super::source::Sources;
use super::{panics, stack};

fn offences(image: &Image) -> Vec<String> {
    let sources = Sources::new(image, "/nowhere".into()).unwrap();
    panics::report(image, &sources).unwrap().offences
}

fn bound(image: &Image) -> Result<stack::Bound, String> {
    let sources = Sources::new(image, "/nowhere".into()).unwrap();
    stack::bound(image, &sources).map_err(|error| format!("{error:#}"))
}

/// The one offence of a program, in which these texts occur in this order.
fn one_offence(source: &str, texts: &[&str]) {
    let Some(image) = image(source) else { return };
    let offences = offences(&image);
    let [offence] = &offences[..] else {
        panic!("not one offence: {offences:#?}");
    };
    let mut rest = offence.as_str();
    for text in texts {
        let Some((_, after)) = rest.split_once(text) else {
            panic!("no `{text}` in {offence}");
        };
        rest = after;
    }
}

fn no_offence(source: &str) -> Option<Image> {
    let image = image(source)?;
    assert_eq!(offences(&image), Vec::<String>::new());
    Some(image)
}

fn named(image: &Image, name: &str) -> u32 {
    let mut functions = image.functions.iter();
    let named = functions.find(|(_, function)| function.name == name);
    *named.unwrap_or_else(|| panic!("no {name}")).0
}

fn depth_of(image: &Image, name: &str) -> i32 {
    let start = named(image, name);
    let graph = Graph::new(image, [start]).unwrap();
    assert!(graph.functions[&start].faults.is_empty());
    graph.functions[&start].depth
}

#[test]
fn a_program_that_only_works_is_clean() {
    no_offence("idle! { leaf(); }");
}

#[test]
fn an_index_is_one_path_with_its_line() {
    one_offence(
        "#[inline(never)]
        fn look(at: usize) -> u8 {
            /* The line. */ black_box([1, 2, 3])[at]
        }
        idle! { output(look(input()).into()); }",
        &[
            "panic_bounds_check",
            "idle",
            "look  called at",
            "fixture.rs",
            &format!("fixture.rs:{} ", fixture::FIRST_LINE + 2),
        ],
    );
}

#[test]
fn branches_to_one_panic_are_told_apart() {
    let Some(image) = image(
        "#[unsafe(no_mangle)] extern \"C\" fn abort() -> ! { loop { core::hint::spin_loop() } }
        naked!(idle: \"cmp r0, #0\", \"beq 1f\", \"bl leaf\", \"cmp r0, #1\", \"bne idle\", \"1: nop\", \"bl abort\");",
    ) else {
        return;
    };
    let idle = panics::idle(&image).unwrap()[0];
    let graph = Graph::new(&image, [idle]).unwrap();
    let (&(site, _), _) = graph.functions[&idle].calls.last_key_value().unwrap();
    assert_eq!(graph.origins(idle, site), [idle + 2, idle + 10]);
    assert_eq!(offences(&image).len(), 1);
}

#[test]
fn a_function_pointer_from_a_variable_is_unknown() {
    one_offence(
        "static mut HOOK: fn() = hook;
        fn hook() {}
        idle! { unsafe { read_volatile(&raw const HOOK)() } }",
        &["blx", "not known"],
    );
}

#[test]
fn a_function_pointer_among_constants_is_followed() {
    one_offence(
        "#[unsafe(no_mangle)] extern \"C\" fn hang() { loop { core::hint::spin_loop() } }
        naked!(idle: \"ldr r1, =leaf\", \"movw r2, #:lower16:hang\", \"movt r2, #:upper16:hang\", \"cmp r0, #0\",
            \"it eq\", \"moveq r1, r2\", \"mov r3, r1\", \"blx r3\", \"b idle\");",
        &["hang never returns", "-> hang"],
    );
}

#[test]
fn a_jump_table_is_followed() {
    // Arms that differ in what no table of constants could hold.
    let arm = |n: usize| {
        format!(
            "{n} => {{ output({}); leaf(); output({}) }}\n",
            7 * n * n,
            n ^ 5
        )
    };
    let arms: String = (0..12).map(arm).collect();
    let Some(image) = no_offence(&format!(
        "#[inline(never)] #[unsafe(no_mangle)] fn choose(way: usize) {{ match way {{ {arms} _ => leaf() }} }}
        idle! {{ choose(input()); }}"
    )) else {
        return;
    };
    let code = decode(&image).unwrap();
    let tables = code
        .values()
        .filter(|instruction| matches!(instruction.operation, Operation::Table { .. }));
    assert_eq!(tables.count(), 1, "the compiler made something else of it");
    let choose = named(&image, "choose");
    let graph = Graph::new(&image, [choose]).unwrap();
    let arms = graph.functions[&choose].jumps.len();
    assert!(arms >= 12, "{arms} places jumped to");
}

#[test]
fn a_jump_table_behind_a_register_is_followed() {
    // The second arm is where it hangs, and only the table leads there. Entries count from behind the `tbb`, wherever the table is.
    one_offence(
        "#[unsafe(no_mangle)] extern \"C\" fn hang() { loop { core::hint::spin_loop() } }
        naked!(idle: \"and r0, r0, #1\", \"adr.w r3, 3f\", \"tbb [r3, r0]\", \"0: nop\", \".balign 4\",
            \"3: .byte (1f - 0b) / 2\", \".byte (2f - 0b) / 2\", \".balign 2\", \"1: b idle\", \"2: bl hang\", \"b idle\");",
        &["hang never returns", "-> hang"],
    );
}

#[test]
fn instructions_that_stop_are_found() {
    for (stop, text) in [
        ("udf #1", "stops the program"),
        ("udf #254", "stops the program"),
        (".inst.w 0xffffffff", "can be decoded"),
        (
            "ldr pc, [r0]",
            "`ldr.w pc, [r0]` to an address that is not known",
        ),
        ("bx r0", "`bx r0` to an address that is not known"),
        ("add pc, r0", "`add pc, r0` to an address that is not known"),
    ] {
        one_offence(
            &format!("naked!(idle: \"cmp r0, #0\", \"beq 1f\", \"b idle\", \"1: {stop}\");"),
            &[text, "idle"],
        );
    }
}

#[test]
fn a_call_that_never_returns_ends_the_way() {
    one_offence(
        "#[unsafe(no_mangle)] extern \"C\" fn hang() -> ! { loop { core::hint::spin_loop() } }
        naked!(idle: \"bl leaf\", \"cmp r0, #0\", \"bne idle\", \"bl hang\", \"udf #0\");",
        &["hang never returns"],
    );
}

#[test]
fn frames_are_exact() {
    let Some(image) = no_offence(
        "naked!(framed: \"push {{r4, r7, lr}}\", \"add r7, sp, #4\", \"str r8, [sp, #-4]!\", \"vpush {{d8, d9}}\",
            \"vpush {{s16}}\", \"sub sp, #40\", \"cmp r0, #0\", \"beq 1f\", \"sub.w sp, sp, #1024\", \"bl leaf\",
            \"add.w sp, sp, #1024\", \"1: add sp, #40\", \"vpop {{s16}}\", \"vpop {{d8, d9}}\", \"ldr r8, [sp], #4\",
            \"pop {{r4, r7, pc}}\");
        naked!(aligned: \"push {{r4, r6, r7, lr}}\", \"add r7, sp, #8\", \"sub sp, #24\", \"mov r4, sp\",
            \"bfc r4, #0, #4\", \"mov sp, r4\", \"bl leaf\", \"sub.w r4, r7, #8\", \"mov sp, r4\",
            \"pop {{r4, r6, r7, pc}}\");
        idle! { unsafe { framed(); aligned() } }",
    ) else {
        return;
    };
    assert_eq!(depth_of(&image, "framed"), 12 + 4 + 16 + 4 + 40 + 1024);
    assert_eq!(depth_of(&image, "aligned"), 16 + 24 + 15);
}

#[test]
fn the_bound_is_the_deepest_way() {
    let Some(image) = image(
        "naked!(deep: \"push {{r4, lr}}\", \"sub sp, #400\", \"bl leaf\", \"add sp, #400\", \"pop {{r4, pc}}\");
        naked!(last: \"push {{r4, lr}}\", \"sub sp, #16\", \"add sp, #16\", \"pop {{r4, lr}}\", \"b deep\");
        naked!(idle: \"push {{r4, lr}}\", \"1: bl leaf\", \"bl last\", \"b 1b\");",
    ) else {
        return;
    };
    let text = bound(&image).map(|bound| bound.text).unwrap();
    // `last` has nothing left on the stack when it jumps to `deep`, nor has `Reset`.
    let first = text.split_whitespace().next().unwrap();
    let expected = 8 + 408 + depth_of(&image, "leaf");
    assert_eq!(
        first.parse(),
        Ok(expected.cast_unsigned().next_multiple_of(8)),
        "{text}"
    );
}

#[test]
fn a_bound_needs_a_known_stack() {
    for (body, error) in [
        (
            "'push {{r4, lr}}', 'sub sp, sp, r0', 'bl leaf', 'b idle'",
            "unknown amount",
        ),
        ("'1: push {{r4, lr}}', 'b 1b'", "unknown amount"),
        (
            "'push {{r4, lr}}', 'msr msp, r0', 'pop {{r4, pc}}'",
            "unknown amount",
        ),
        (
            "'push {{r4, lr}}', 'bl idle', 'pop {{r4, pc}}'",
            "recursion: idle -> idle",
        ),
        ("'push {{r4, lr}}', 'bx lr'", "a return with 8 bytes"),
        (
            "'blx r0', 'b idle'",
            "`blx r0` to an address that is not known",
        ),
    ] {
        let Some(image) = image(&format!("naked!(idle: {});", body.replace('\'', "\""))) else {
            return;
        };
        let found = bound(&image).err().unwrap_or_default();
        assert!(found.contains(error), "no `{error}` in `{found}`");
    }
}

#[test]
fn functions_that_call_each_other_are_recursion() {
    let Some(image) = image(
        "naked!(even: \"push {{r4, lr}}\", \"cbz r0, 1f\", \"bl odd\", \"1: pop {{r4, pc}}\");
        naked!(odd: \"push {{r4, lr}}\", \"bl even\", \"pop {{r4, pc}}\");
        idle! { unsafe { even() } }",
    ) else {
        return;
    };
    let found = bound(&image).err().unwrap_or_default();
    assert!(found.contains("recursion: even -> odd -> even"), "{found}");
}
