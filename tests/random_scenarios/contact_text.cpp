#include "random_scenarios/contact_text.hpp"

#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "random_scenarios/draws.hpp"

namespace grapnel::testing {
namespace {

class ContactWriter {
 public:
  std::string scenario() {
    text_ = "schema: grapnel-scenario/1\nname: random contacts\n";
    mass_ = decades(1, 1000);
    hard_ = percent(40);
    grasping_ = percent(50);
    if (percent(20)) line("gravity: " + list(vector(1)));
    write_robot();
    write_initial();
    write_targets();
    if (grasping_) write_grasps();
    write_phases();
    write_surfaces();
    // Stiff friction and damping take many steps; such runs stop with an error.
    line("integration: {max_steps: 2000}");
    line("output: {interval: 0.05}");
    return text_;
  }

 private:
  void line(const std::string& text) { text_ += text + "\n"; }

  // A direction that is never nearly zero.
  static Vector3d direction() {
    Vector3d v = vector(1);
    v[integer(0, 2)] = percent(50) ? 1 : -1;
    return 1 / norm(v) * v;
  }

  static std::string shape(double size, const Vector3d& position) {
    const auto length = [size] { return size * uniform(0.3, 1); };
    std::string at = ", position: " + list(position);
    if (percent(40)) at += ", rpy: " + list(vector(3));
    const std::string kind = any_of<4>({"box", "sphere", "capsule", "cylinder"});
    if (kind == "box")
      return fmt::format("{{shape: box, size: {}{}}}", list(Numbers{2 * length(), 2 * length(), length()}), at);
    if (kind == "sphere") return fmt::format("{{shape: sphere, radius: {:.4g}{}}}", length(), at);
    return fmt::format("{{shape: {}, radius: {:.4g}, length: {:.4g}{}}}", kind, 0.5 * length(), length(), at);
  }

  void write_robot() {
    base_mode_ = any_of<7>({"free", "free", "free", "free", "free", "held", "fixed"});
    line("robot:");
    line(fmt::format("  base: {{mode: {}, {}, geometry: {}}}", base_mode_, body(mass_, 0.3, 1, 0.05),
                     shape(0.3, Vector3d::zero())));
    line("  links:");
    const int arms = integer(1, 2);
    for (int arm = 1; arm <= arms; ++arm) write_arm(arm);
    line("  end_effectors:");
    for (int arm = 1; arm <= arms; ++arm)
      line(fmt::format("    - {{name: tip-{}, link: {}, position: [0.3, 0, 0]}}", arm, tips_[arm - 1]));
  }

  void write_arm(int arm) {
    const int count = integer(1, 4);
    for (int i = 1; i <= count; ++i) {
      const std::string name = fmt::format("link-{}-{}", arm, i);
      line(fmt::format("    - name: {}\n      parent: {}", name, i == 1 ? "base" : tips_.back()));
      line("      joint: {" + joint(fmt::format("joint-{}-{}", arm, i), i == 1) + "}");
      line("      " + in_lines(body(mass_ * decades(0.01, 0.3), 0.1, 0.4, 0.1), "      "));
      if (percent(70)) line("      geometry: " + shape(0.06, {0.2, 0, 0}));
      i == 1 ? tips_.push_back(name) : void(tips_.back() = name);
    }
  }

  std::string joint(const std::string& name, bool first) {
    const std::string type = any_of<4>({"revolute", "revolute", "continuous", "prismatic"});
    const Vector3d origin = first ? 0.5 * direction() : Vector3d{uniform(0.25, 0.5), 0, 0};
    std::string text = fmt::format("name: {}, type: {}, axis: {}, origin: {{position: {}, rpy: {}}}", name, type,
                                   unit_vector(), list(origin), list(vector(first ? 1 : 0.4)));
    if (type != "prismatic" && !turning_.empty() && percent(15)) {
      return text + fmt::format(", mimic: {{joint: {}, ratio: {}}}",
                                turning_[static_cast<std::size_t>(integer(0, static_cast<int>(turning_.size()) - 1))],
                                any_of<4>({"1", "-1", "0.5", "2"}));
    }
    if (type != "continuous" && percent(40)) {
      text += fmt::format(", limits: {{lower: {:.3g}, upper: {:.3g}{}}}", -uniform(0.2, 1), uniform(0.2, 1),
                          percent(50) ? ", stop: {restitution: 0.3}" : "");
    }
    if (percent(30)) text += fmt::format(", friction: {{viscous: {:.3g}}}", mass_ * decades(1e-4, 1e-2));
    joints_.push_back(name);
    if (type != "prismatic") turning_.push_back(name);
    return text;
  }

  std::string joint_values(double size) {
    std::string text;
    for (const std::string& name : joints_) text += fmt::format(", {}: {:.3g}", name, around(size));
    return "{" + text.substr(2) + "}";
  }

  void write_initial() {
    line("initial:");
    line("  joints: " + joint_values(0.1));
    if (percent(50)) line("  joint_rates: " + joint_values(0.5));
    if (base_mode_ == "free" && percent(50)) {
      line(fmt::format("  base: {{velocity: {}, angular_velocity: {}}}", list(vector(0.3)), list(vector(0.5))));
    }
  }

  void write_targets() {
    targets_ = integer(1, 3);
    line("targets:");
    for (int t = 1; t <= targets_; ++t) {
      const Vector3d d = direction();
      line(fmt::format("  - name: target-{}", t));
      line("    " + in_lines(body(mass_ * decades(0.01, 3), 0.1, 0.5, 0.05), "    "));
      line(fmt::format("    state: {{at: start, position: {}, rpy: {}, velocity: {}, angular_velocity: {}}}",
                       list(uniform(1.3, 2.5) * d), list(vector(3)), list(-uniform(0.3, 2.5) * d + vector(0.2)),
                       list(vector(1.5))));
      std::string shapes = shape(0.2, vector(0.2));
      for (int more = integer(0, 2); more > 0; --more) shapes += ", " + shape(0.2, vector(0.2));
      line("    geometry: [" + shapes + "]");
      line("    grasp_points: [{name: grip, position: " + list(vector(0.2)) + "}]");
    }
  }

  void write_grasps() {
    line("grasps:");
    for (int arm = 1; arm <= integer(1, static_cast<int>(tips_.size())); ++arm) {
      const std::string model = any_of<3>({"rigid", "rigid", "point"});
      std::string text = fmt::format("end_effector: tip-{}, target: target-{}, point: grip, model: {}", arm,
                                     integer(1, targets_), model);
      if (percent(60)) {
        text += fmt::format(", holds: {{force: {:.3g}{}}}", mass_ * decades(0.1, 10),
                            model == "rigid" ? fmt::format(", moment: {:.3g}", mass_ * decades(0.1, 10)) : "");
      }
      if (percent(50)) text += fmt::format(", closes_at: {:.3g}", uniform(0.1, 1.5));
      line("  - {" + text + "}");
    }
    line("contact: {gap: weld_as_found, largest_gap: any}");
  }

  void write_phases() {
    std::string joints = any_of<3>({"free", "braked", "pd"});
    if (joints == "pd")
      joints += fmt::format(", kp: {:.3g}, kd: {:.3g}", mass_ * decades(0.1, 10), mass_ * decades(0.1, 3));
    if (!grasping_) {
      line(fmt::format("motion: {{duration: {:.3g}, joints: {}}}", uniform(1, 2.5), joints));
      return;
    }
    line("approach: {duration: 0.5, profile: quintic, final_joints: " + joint_values(0.1) + "}");
    line("impact: {duration: 0.01}");
    line(fmt::format("post_impact: {{duration: {:.3g}, joints: {}{}}}", uniform(1, 2), joints,
                     percent(30) ? ", release: [{after: 0.7}]" : ""));
  }

  void write_surfaces() {
    std::string text = "name: skin, ";
    text += percent(60) ? fmt::format("stiffness: {:.3g}", mass_ * decades(1e2, 1e5))
                        : fmt::format("youngs_modulus: {:.3g}, poisson_ratio: 0.3", mass_ * decades(1e4, 1e7));
    if (hard_) {
      text += ", hard: true, restitution: " + any_of<4>({"0", "0.3", "0.8", "1"});
    } else if (percent(50)) {
      text += ", restitution: " + any_of<3>({"0.2", "0.5", "0.9"});
    }
    if (percent(30)) text += fmt::format(", damping: {:.3g}", mass_ * decades(0.1, 30));
    if (percent(40)) text += percent(50) ? ", friction: {static: 0.4, kinetic: 0.3}" : ", friction: 0.3";
    if (percent(20)) text += ", rolling_length: 0.002, torsional_length: 0.003";
    line("materials:\n  - {" + text + "}");
    if (percent(50)) {
      line("obstacles:");
      line(fmt::format("  - {{name: floor, half_space: true, position: [0, 0, {:.3g}]}}", -uniform(1, 2)));
      line(fmt::format("  - {{name: post, geometry: {}, position: {}}}", shape(0.3, Vector3d::zero()),
                       list(1.8 * direction())));
    }
    line("contacts: {all: true, material: skin}");
  }

  std::string text_;
  double mass_ = 1;  // of the base [kg]
  bool hard_ = false, grasping_ = false;
  std::string base_mode_;
  std::vector<std::string> tips_;     // last link per arm
  std::vector<std::string> joints_;   // independent joints
  std::vector<std::string> turning_;  // of them those that turn
  int targets_ = 1;
};

}  // namespace

rc::Gen<ScenarioText> contact_text() {
  return rc::gen::exec([] { return ScenarioText{ContactWriter().scenario()}; });
}

}  // namespace grapnel::testing
