#include <algorithm>

#include "commands.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

// A body's mass properties summed over the whole robot at zero joint angles, about its centre of mass, in base axes.
RigidBodyInertiad composite(const Model& model, const Kinematics& k) {
  RigidBodyInertiad total = RigidBodyInertiad::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    total += shift_origin(world_inertia(model, k, static_cast<int>(i)), k.X_WB[i].p);
  }
  return total;
}

// Farthest an end-effector can get from the point where its arm leaves the base: the sum of the distances between
// joints.
double reach(const Model& model, const Frame& frame) {
  double length = norm(frame.X_BE.p);
  for (int i = frame.body; model.bodies()[i].parent >= 0; i = model.bodies()[i].parent) {
    const Body& body = model.bodies()[i];
    const JointDescription& joint = body.description.joint;
    if (slides_along_axis(joint.type)) length += std::max(std::abs(joint.limits.lower), std::abs(joint.limits.upper));
    if (model.bodies()[body.parent].parent >= 0) length += norm(body.description.X_PF.p);
  }
  return length;
}

void print_bodies(const Model& model) {
  to_stdout("\n{:<22}{:<22}{:<22}{:<12}{:>12}\n", "body", "parent", "joint", "type", "mass [kg]");
  for (const Body& b : model.bodies()) {
    to_stdout("{:<22}{:<22}{:<22}{:<12}{:>12.6g}\n", b.description.name,
              b.parent < 0 ? "-" : model.bodies()[b.parent].description.name,
              b.parent < 0 ? "-" : b.description.joint.name, traits_of(b.description.joint.type).name,
              b.description.mass);
  }
}

}  // namespace

int info(const std::filesystem::path& file) {
  try {
    CaptureProblem problem;
    std::vector<Fault> warnings;
    problem.robot = load_robot(file, &warnings);
    say_faults(warnings);
    const CaptureSystem system = make_servicer(problem);
    const Model& model = system.model;
    const Kinematics k = forward_kinematics(model, zero_state(model));
    const RigidBodyInertiad total = composite(model, k);
    const Vector3d c = total.com();
    const Symmetric3d I = total.rotational_about_com();
    to_stdout("{}: {} bodies, {} joints, {} end-effectors\n", problem.robot.name, model.bodies().size(),
              model.joints().size(), model.frames().size());
    to_stdout("mass {:.6g} kg\n", total.mass);
    to_stdout("at zero joint positions, in the base frame:\n");
    to_stdout("  centre of mass     [{:.6g}, {:.6g}, {:.6g}] m\n", c[0], c[1], c[2]);
    to_stdout("  inertia about it   xx {:.6g}, yy {:.6g}, zz {:.6g}, xy {:.6g}, xz {:.6g}, yz {:.6g} kg m^2\n", I.xx,
              I.yy, I.zz, I.xy, I.xz, I.yz);
    print_bodies(model);
    to_stdout("\n{:<22}{:<22}{:>12}   {}\n", "end-effector", "link", "reach [m]", "position at zero joints [m]");
    for (int f : system.end_effectors) {
      const Frame& frame = model.frames()[f];
      const Vector3d p = frame_pose(model, k, f).p;
      to_stdout("{:<22}{:<22}{:>12.6g}   [{:.6g}, {:.6g}, {:.6g}]\n", frame.name,
                model.bodies()[frame.body].description.name, reach(model, frame), p[0], p[1], p[2]);
    }
    to_stdout("reach: longest possible distance from the arm's first joint\n");
    return kDone;
  } catch (const InputError& error) {
    say_faults(error.faults());
  }
  return kBadInput;
}

}  // namespace grapnel::app
