//! What a person is told, word by word.

#[test]
fn x() {
    let text = "task pick(o: Graspable) {\n    needs visible(o\n    either side prior 0.7 { grasp(o, side) }\n    or     top  prior 0.3 { grasp(o, top }\n    lift(o, by: 12 centimetres) while holding(o)\n}\n\n/// Pour.\ntask pour(source: Container target: Container) {\n    lift(source)\n}\n\ntsak place(o: Graspable) {\n    lower(o)\n}\n";
    let source = trueup::language::Source::new("bad.task", text);
    for d in trueup::language::parse(text).1 {
        println!("{}", trueup::language::render(&d, &source, trueup::language::Style::Plain));
    }
    panic!();
}
