//! Universal Robots by Real-Time Data Exchange over TCP, protocol versions 1 and 2.
//!
//! Source: Universal Robots, Real-Time Data Exchange (RTDE) Guide,
//! <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html>; the URScript manual for the
//! functions of [`SCRIPT`].
//!
//! RTDE writes registers; what moves the arm is a program on the controller that reads them. [`SCRIPT`] is that program: it is
//! started on the robot, or sent to its port 30002 ([`send_script`]). It has a watch of its own: a controller that hears nothing
//! for a tenth of a second stops it.

mod arm;
mod rtde;
mod wrist;

pub use arm::{Controller, Motion, State, UrArm, UrLimits, UrSettings, send_script};
pub use rtde::{Rtde, Type, Value};
pub use wrist::UrWrist;

/// The program on the controller: it follows a pose or a speed from the input registers, and says which command it has carried out.
///
/// Registers: doubles 0 to 5 the pose (m, rotation vector in rad) or speed (m/s, rad/s), double 6 the speed of a pose in m/s,
/// double 7 in rad/s; integer 0 a beat, 1 the number of the command, 2 what it is (0 stop, 1 pose, 2 speed). Output integer 0 is
/// the number of the command that has been carried out.
pub const SCRIPT: &str = r#"def interactive_perception():
  rtde_set_watchdog("input_int_register_0", 10, "stop")
  dt = get_steptime()
  done = -1
  while True:
    number = read_input_integer_register(1)
    kind = read_input_integer_register(2)
    a = read_input_float_register(0)
    b = read_input_float_register(1)
    c = read_input_float_register(2)
    d = read_input_float_register(3)
    e = read_input_float_register(4)
    f = read_input_float_register(5)
    if number == done:
      sync()
    elif kind == 1:
      goal = p[a, b, c, d, e, f]
      now = get_target_tcp_pose()
      way = point_dist(now, goal)
      turned = pose_sub(goal, now)
      turn = norm([turned[3], turned[4], turned[5]])
      part = 1.0
      if way > read_input_float_register(6) * dt:
        part = read_input_float_register(6) * dt / way
      end
      if turn * part > read_input_float_register(7) * dt:
        part = read_input_float_register(7) * dt / turn
      end
      servoj(get_inverse_kin(interpolate_pose(now, goal, part)), t=dt)
      if part >= 1.0:
        write_output_integer_register(0, number)
        done = number
      end
    elif kind == 2:
      speedl([a, b, c, d, e, f], a=0.5, t=dt)
    else:
      stopl(1.0)
      write_output_integer_register(0, number)
      done = number
    end
  end
end
"#;
