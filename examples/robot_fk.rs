//! Where the Gen3's flange and tool are in its named poses, what holding them takes, and one way back
//! from the pose to joint positions.
//!
//! Run with `cargo run --example robot_fk`.

use trueup::motion::Robot;
use trueup::motion::dynamics::{Bodies, Dynamics};
use trueup::motion::ik::Solver;

#[expect(clippy::print_stdout, reason = "an example shows what it computes")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let robot = Robot::gen3();
    let dynamics = Dynamics::new(&robot, Bodies::All);
    let solver = Solver::new(&robot);
    for (name, q) in robot.poses() {
        let flange = robot.forward(q)?;
        let tool = robot.forward_tool(q)?.origin();
        let torques = dynamics.gravity_torques(q)?;
        println!("{name}: tool at ({:.4}, {:.4}, {:.4}) m", tool.x, tool.y, tool.z);
        println!("  torque that holds joint 2 still: {:.3} N·m", torques[1]);
        match solver.nearest(&flange, q) {
            Ok(back) => println!("  joints found again, rad: {back:.4?}"),
            Err(why) => println!("  not found again: {:?}", why.reason),
        }
    }
    Ok(())
}
