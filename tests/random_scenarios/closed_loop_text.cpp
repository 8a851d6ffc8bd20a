#include "random_scenarios/closed_loop_text.hpp"

#include <fmt/format.h>

#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "random_scenarios/draws.hpp"

namespace grapnel::testing {
namespace {

const Vector3d kVertical{0, 0, 1};

class LoopWriter {
 public:
  std::string scenario() {
    planar_ = percent(50);
    planned_ = percent(50);
    mass_ = decades(50, 2000);
    text_ = "schema: grapnel-scenario/1\nname: random closed loop\n";
    line("robot:");
    line("  base: {" + part(mass_, 0.6, 1.4) + "}");
    line("  links:");
    arms_ = integer(2, 3);
    for (int arm = 1; arm <= arms_; ++arm) write_arm(arm);
    line("  end_effectors:");
    for (int arm = 1; arm <= arms_; ++arm) {
      line(fmt::format("    - {{name: tip-{0}, link: link-{0}-{1}, position: {2}}}", arm, counts_[arm - 1],
                       list(reach_[arm - 1])));
    }
    write_initial();
    write_targets();
    if (planned_) {
      line(
          fmt::format("approach: {{duration: {:.3g}, profile: quintic, plan: {{objective: as_found}}, final_rates: "
                      "{{match: velocity_least_rates}}}}",
                      uniform(5, 15)));
    }
    line("impact: {}");
    line(fmt::format("post_impact: {{duration: {:.4g}}}", uniform(20, 60)));
    line("output: {interval: 0.25}");
    return text_;
  }

 private:
  void line(const std::string& text) { text_ += text + "\n"; }

  // A vector in the plane, or in space.
  Vector3d vector_in(double size) const {
    if (!planar_) return vector(size);
    return {around(size), around(size), 0};
  }
  Vector3d turning(double size) const { return planar_ ? around(size) * kVertical : vector(size); }

  // Mass, centre of mass and inertia of a box; planar boxes are parallel to the plane.
  std::string part(double mass, double least, double most) const {
    if (!planar_) return body(mass, least, most, 0.1);
    const double a = uniform(least, most), b = uniform(least, most), c = uniform(least, most);
    return fmt::format("mass: {:.6g}, com: {}, inertia: {}", mass, list(vector_in(0.1)),
                       list(mass / 12 * Vector3d{b * b + c * c, a * a + c * c, a * a + b * b}));
  }

  // Arms start around the base and extend away from it; all lengths along x of the link's frame.
  void write_arm(int arm) {
    // A grasp requires three joints in the plane and six in space; some arms have fewer or more.
    const int count = planar_ ? integer(2, 4) : integer(planned_ ? 5 : 3, 7);
    const double around_base = 2.1 * (arm - 1) + around(0.3), radius = 0.5;
    const Rotationd R_BA = rotation_from_rpy(0, 0, around_base);
    Posed X_WF = {Rotationd::identity(), Vector3d::zero()};  // of the link, in the base's frame, which W is at t = 0
    for (int i = 1; i <= count; ++i) {
      const Vector3d rpy = i == 1 ? Vector3d{0, 0, around_base} : (planar_ ? Vector3d::zero() : vector(1.5));
      const Vector3d origin = i == 1 ? R_BA * Vector3d{radius, 0, 0} : Vector3d{length_, 0, 0};
      const Vector3d axis = planar_ ? kVertical : Vector3d::unit(integer(0, 2));
      const double value = around(1.3);
      line(fmt::format("    - name: link-{}-{}\n      parent: {}", arm, i,
                       i == 1 ? "base" : fmt::format("link-{}-{}", arm, i - 1)));
      line(
          fmt::format("      joint: {{name: joint-{}-{}, type: revolute, axis: {}, origin: {{position: {}, rpy: {}}}}}",
                      arm, i, list(axis), list(origin, "{:.17g}"), list(rpy)));
      length_ = uniform(0.3, 1);
      line("      " + in_lines(part(mass_ * decades(0.01, 0.1), 0.1, length_), "      "));
      X_WF = X_WF * Posed{rotation_from_rpy(rpy[0], rpy[1], rpy[2]), origin} *
             Posed{rotation_about(axis, value), Vector3d::zero()};
      values_.push_back(value);
    }
    counts_.push_back(count);
    reach_.push_back({length_, 0, 0});
    tips_.push_back(X_WF * reach_.back());
  }

  void write_initial() {
    Numbers rates;
    for (std::size_t i = 0; i < values_.size(); ++i) rates.push_back(around(0.1));
    line("initial:");
    line(fmt::format("  base: {{velocity: {}, angular_velocity: {}}}", list(vector_in(planned_ ? 0.005 : 0.05)),
                     list(turning(planned_ ? 0.01 : 0.1))));
    line("  joints: " + list(values_));
    if (!planned_) line("  joint_rates: " + list(rates));
  }

  // Targets around the initial end-effector positions, with an offset if there is an approach.
  void write_targets() {
    const bool mixed = arms_ == 3 && percent(30);
    const int shared = mixed ? 2 : integer(2, arms_);
    std::string grasps;
    line("targets:");
    write_target(1, 0, shared);
    if (mixed) write_target(2, 2, 3);
    line("grasps:");
    for (int arm = 1; arm <= (mixed ? 3 : shared); ++arm) {
      const std::string model = any_of<5>({"rigid", "rigid", "rigid", "hinge", "point"});
      line(fmt::format("  - {{end_effector: tip-{0}, target: target-{1}, point: grip-{0}, model: {2}{3}}}", arm,
                       mixed && arm == 3 ? 2 : 1, model,
                       model == "hinge" ? ", axis: " + list(planar_ ? kVertical : Vector3d::unit(integer(0, 2))) : ""));
    }
  }
  void write_target(int number, int first, int end) {
    Vector3d middle = Vector3d::zero();
    for (int arm = first; arm < end; ++arm) middle += 1.0 / (end - first) * tips_[arm];
    const Vector3d rpy = planar_ ? around(3) * kVertical : vector(1.5);
    const Posed X_WT{rotation_from_rpy(rpy[0], rpy[1], rpy[2]), middle + vector_in(0.3)};
    const Vector3d aside = planned_ ? vector_in(0.15) : Vector3d::zero();
    line(fmt::format("  - name: target-{}", number));
    line("    " + in_lines(part(mass_ * decades(0.05, 3), 0.4, 2), "    "));
    line(fmt::format("    state: {{position: {}, rpy: {}, velocity: {}, angular_velocity: {}}}",
                     list(X_WT.p + aside, "{:.17g}"), list(rpy), list(vector_in(0.05)), list(turning(0.1))));
    line("    grasp_points:");
    for (int arm = first; arm < end; ++arm) {
      line(
          fmt::format("      - {{name: grip-{}, position: {}}}", arm + 1, list(inverse(X_WT) * tips_[arm], "{:.17g}")));
    }
  }

  std::string text_;
  bool planar_ = false;
  bool planned_ = false;
  double mass_ = 1;  // of the base [kg]
  int arms_ = 2;
  double length_ = 0;            // of the last link written [m]
  std::vector<int> counts_;      // joints, per arm
  std::vector<Vector3d> reach_;  // of the end-effector, in the last link's frame [m]
  std::vector<Vector3d> tips_;   // end-effector position at t = 0 [m]
  Numbers values_;               // of joints at t = 0, in the model's order [rad]
};

}  // namespace

rc::Gen<ScenarioText> closed_loop_text() {
  return rc::gen::exec([] { return ScenarioText{LoopWriter().scenario()}; });
}

}  // namespace grapnel::testing
