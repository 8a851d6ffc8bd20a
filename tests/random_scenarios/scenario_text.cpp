#include "random_scenarios/scenario_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ostream>
#include <vector>

#include "random_scenarios/draws.hpp"

namespace grapnel::testing {
namespace {

// What the rest of the scenario must respect of a joint that moves.
struct Joint {
  std::string name;
  double lower, upper, rate;
};

class Writer {
 public:
  std::string scenario() {
    text_ = "schema: grapnel-scenario/1\nname: random\n";
    mass_ = decades(0.1, 1e4);
    robot();
    if (percent(15)) line("gravity: " + list(vector(2)));
    initial();
    phases();
    if (percent(20)) write_loads();
    // A run that needs too many steps stops with an error.
    line(fmt::format("integration: {{max_steps: 5000{}{}{}}}", percent(10) ? ", root_velocity: integrated" : "",
                     percent(3) ? ", method: rk4, step: 1e-3" : "",
                     percent(5) ? ", loops: " + any_of<2>({"baumgarte", "acceleration"}) : ""));
    line(fmt::format("output: {{interval: {:.3g}}}", uniform(0.02, 0.07)));
    return text_;
  }

 private:
  void line(const std::string& text) { text_ += text + "\n"; }

  void robot() {
    base_mode_ = any_of<6>({"free", "free", "free", "free", "held", "fixed"});
    line("robot:");
    line(fmt::format("  base: {{mode: {}, {}}}", base_mode_, body(mass_, 0.3, 3, 0.1)));
    arms_ = integer(1, 3);
    line("  links:");
    for (int arm = 1; arm <= arms_; ++arm) write_arm(arm);
    line("  end_effectors:");
    for (int arm = 1; arm <= arms_; ++arm) {
      envelopes_.push_back(percent(15));
      line(fmt::format("    - {{name: tip-{}, link: {}, {}{}}}", arm, last_links_[arm - 1], pose(0.5),
                       envelopes_.back() ? fmt::format(", envelope: {{position: {:.3g}}}", uniform(1, 10)) : ""));
    }
  }

  void write_arm(int arm) {
    std::vector<std::string> parents{"base"};
    const int count = integer(1, 7);
    for (int i = 1; i <= count; ++i) {
      const std::string name = fmt::format("link-{}-{}", arm, i);
      // Mostly a chain; sometimes a branch, which ends before the arm does.
      const std::size_t parent =
          percent(15) ? static_cast<std::size_t>(integer(0, static_cast<int>(parents.size()) - 1)) : parents.size() - 1;
      line(fmt::format("    - name: {}\n      parent: {}", name, parents[parent]));
      // The first joint of every arm moves.
      line("      joint: {" + joint(fmt::format("joint-{}-{}", arm, i), i > 1) + "}");
      line("      " + in_lines(body(mass_ * decades(0.01, 0.3), 0.1, 1.5, 0.4), "      "));
      parents.push_back(name);
    }
    last_links_.push_back(parents.back());
  }

  std::string joint(const std::string& name, bool may_be_fixed) {
    std::string type =
        any_of<8>({"revolute", "revolute", "revolute", "continuous", "continuous", "prismatic", "prismatic", "fixed"});
    if (type == "fixed" && !may_be_fixed) type = "revolute";
    std::string text = fmt::format("name: {}, type: {}, origin: {{{}}}", name, type, pose(1));
    if (type == "fixed") return text;
    text += ", axis: " + unit_vector();
    Joint j{name, -2, 2, 1};
    std::string limits;
    if (type != "continuous" && percent(40)) {
      j.lower = -uniform(0, 1.5), j.upper = uniform(0, 1.5);
      limits += fmt::format(", lower: {:.6g}, upper: {:.6g}", j.lower, j.upper);
    }
    if (percent(25)) j.rate = uniform(0.01, 1), limits += fmt::format(", rate: {:.6g}", j.rate);
    if (percent(25)) limits += fmt::format(", effort: {:.4g}", mass_ * decades(0.1, 100));
    if (!limits.empty()) text += ", limits: {" + limits.substr(2) + "}";
    if (percent(25)) {
      text += fmt::format(", friction: {{viscous: {:.4g}", mass_ * decades(1e-4, 1e-1));
      if (percent(40)) {
        text +=
            fmt::format(", coulomb: {:.4g}, transition_rate: {:.4g}", mass_ * decades(1e-5, 1e-3), decades(1e-3, 1e-1));
      }
      text += "}";
    }
    if (percent(20)) {
      text += fmt::format(", rotor_inertia: {:.4g}, gear_ratio: {}", mass_ * decades(1e-7, 1e-5), integer(1, 100));
    }
    joints_.push_back(j);
    return text;
  }

  // {joint: value, ...} or a list. With `all` no joint is left out of a mapping.
  template <class Value>
  std::string joint_values(bool all, Value value) {
    std::string mapping;
    Numbers numbers;
    for (const Joint& j : joints_) {
      numbers.push_back(value(j));
      if (all || percent(80)) mapping += fmt::format(", {}: {:.12g}", j.name, numbers.back());
    }
    if (percent(50)) return list(numbers);
    return "{" + (mapping.empty() ? "" : mapping.substr(2)) + "}";
  }
  std::string positions() {
    return joint_values(true, [](const Joint& j) { return j.lower + (j.upper - j.lower) * uniform(0, 1); });
  }
  std::string rates() {
    return joint_values(false, [](const Joint& j) { return around(0.5 * j.rate); });
  }

  void initial() {
    line("initial:");
    line("  joints: " + positions());
    moving_ = percent(30);
    if (moving_) line("  joint_rates: " + rates());
    if (percent(70)) {
      std::string base = pose(5);
      const int motion = base_mode_ == "free" ? integer(0, 2) : 0;
      if (motion == 1)
        base += fmt::format(", velocity: {}, angular_velocity: {}", list(vector(0.5)), list(vector(0.5)));
      if (motion == 2) {
        base += fmt::format(", momentum: {{linear: {}, angular: {}}}", list(vector(0.3 * mass_)),
                            list(vector(0.3 * mass_)));
      }
      line("  base: {" + base + "}");
    }
  }

  void phases() {
    const bool grasps = percent(90);
    const bool approach = !grasps || percent(85);
    impact_ = grasps && (!approach || percent(85));
    approach_s_ = approach ? uniform(0.2, 1) : 0;
    after_s_ = impact_ && percent(75) ? uniform(0.1, 1) : 0;
    if (grasps) write_targets();
    if (approach) write_approach(grasps);
    if (impact_) line(fmt::format("impact: {{duration: {:.3g}}}", decades(1e-4, 1e-1)));
    if (after_s_ > 0) {
      line(fmt::format("post_impact: {{duration: {:.12g}, {}{}}}", after_s_, joints_after(), releases()));
    }
    // Targets are anywhere, within reach or not.
    if (grasps) {
      const bool moved = percent(40) && !percent(30);
      line(fmt::format("contact: {{gap: {}, largest_gap: any}}", moved ? "translate_target" : "weld_as_found"));
    }
  }

  // Every arm that grasps has a separate target, or shares one with others.
  void write_targets() {
    const int grasps = integer(1, arms_);
    const bool share = grasps > 1 && percent(60);
    std::vector<int> target_of{1};
    for (int g = 2; g <= grasps; ++g) {
      const int last = *std::max_element(target_of.begin(), target_of.end());
      target_of.push_back(share && (g == 2 || percent(70)) ? integer(1, last) : last + 1);
    }
    targets_ = *std::max_element(target_of.begin(), target_of.end());
    line("targets:");
    for (int t = 1; t <= targets_; ++t) {
      line(fmt::format("  - name: target-{}", t));
      line("    " + in_lines(body(mass_ * decades(0.003, 10), 0.2, 2, 0.3), "    "));
      line(fmt::format("    state: {{at: {}, {}, velocity: {}, angular_velocity: {}}}", any_of<2>({"capture", "start"}),
                       pose(5), list(vector(0.5)), list(vector(1))));
      line(fmt::format("    grasp_points: [{{name: grip, {}}}, {{name: handle, {}}}]", pose(0.8), pose(0.8)));
    }
    line("grasps:");
    for (int g = 1; g <= grasps; ++g) {
      line(fmt::format("  - {{end_effector: tip-{}, target: target-{}, point: {}, {}{}}}", g, target_of[g - 1],
                       any_of<2>({"grip", "handle"}), grasp(), closing(g)));
    }
  }

  // When a grasp closes; noted for what release.
  std::string closing(int arm) {
    closes_.push_back(0);
    if (!impact_ || !percent(20)) return "";
    if (envelopes_[arm - 1] && percent(50)) return ", closes_on_arrival: true";
    const double time = uniform(0.05, 1) * (approach_s_ + after_s_);
    if (time <= 0) return "";
    closes_.back() = time;
    return fmt::format(", closes_at: {:.12g}", time);
  }

  // One grasp release, or all; what closes later than that still holds.
  std::string releases() {
    if (!percent(30)) return "";
    const double after = uniform(0.1, 0.9) * after_s_;
    if (percent(50)) return fmt::format(", release: [{{after: {:.12g}}}]", after);
    const int arm = integer(1, static_cast<int>(closes_.size()));
    if (closes_[arm - 1] >= approach_s_ + after) return "";
    return fmt::format(", release: [{{after: {:.12g}, end_effectors: [tip-{}]}}]", after, arm);
  }
  static std::string grasp() {
    const std::string model = any_of<3>({"rigid", "point", "hinge"});
    return "model: " + model + (model == "hinge" ? ", axis: " + unit_vector() : "");
  }

  // A bandwidth that suits the robot's size: a stiff drive on a light link would take the integrator forever.
  std::string gains() {
    const double omega = decades(0.3, 10), damping = uniform(0.3, 1.5), inertia = 0.1 * mass_;
    return fmt::format("kp: {:.4g}, kd: {:.4g}", inertia * omega * omega, 2 * damping * omega * inertia);
  }
  std::string joints_after() {
    const std::string joints = any_of<3>({"free", "braked", "pd"});
    return "joints: " + joints + (joints == "pd" ? ", " + gains() : "");
  }

  // A force and a torque on the base and, if there is one, on the first target.
  void write_loads() {
    line("external_wrenches:");
    write_load("body: base");
    if (targets_ > 0) write_load("target: target-1");
  }
  void write_load(const std::string& on) {
    const std::string shape = any_of<4>({"constant", "half_sine", "sine", "table"});
    const auto wrench = [&] { return std::array{vector(mass_), vector(0.3 * mass_)}; };
    std::string text =
        fmt::format("  - {{{}, position: {}, frame: {}", on, list(vector(0.5)), any_of<2>({"world", "body"}));
    if (shape == "table") {
      text += ", time: {shape: table, values: [";
      for (int row = 0; row < 3; ++row) {
        const auto [f, m] = wrench();
        text += (row > 0 ? ", " : "") + list(Numbers{0.3 * row, f[0], f[1], f[2], m[0], m[1], m[2]});
      }
      line(text + "]}}");
      return;
    }
    const auto [force, torque] = wrench();
    text += fmt::format(", force: {}, torque: {}, time: {{shape: {}", list(force), list(torque), shape);
    if (shape != "constant") text += fmt::format(", start: {:.3g}", uniform(0, 0.3));
    if (shape == "half_sine") text += fmt::format(", end: {:.3g}", uniform(0.4, 1));
    if (shape == "sine") text += fmt::format(", frequency: {:.3g}, phase: {:.3g}", uniform(0.1, 5), around(3));
    line(text + "}}");
  }

  // Attitude control of the base, as fast as the joints' drives.
  std::string base_control() {
    const double omega = decades(0.3, 5), inertia = mass_;
    return fmt::format("base_control: {{kp: {:.4g}, kd: {:.4g}{}{}}}", inertia * omega * omega, inertia * omega,
                       percent(30) ? fmt::format(", limit: {:.4g}", mass_ * decades(0.1, 10)) : "",
                       percent(30) ? ", rpy: " + list(vector(1)) : "");
  }

  void write_approach(bool grasps) {
    line("approach:");
    line(fmt::format("  duration: {:.12g}", approach_s_));
    const std::string mode = any_of<5>({"ideal", "ideal", "pd", "pd", "computed_torque"});
    const bool waypoint = percent(20);
    // The quartic profile starts from rest.
    const bool passing = waypoint || (moving_ && mode == "ideal");
    const std::string profile = any_of<3>({"quintic", "cycloidal", "quartic"});
    line("  profile: " + (profile == "quartic" && passing ? "quintic" : profile));
    line("  final_joints: " + positions());
    const int kind = integer(0, grasps ? 2 : 1);
    if (kind == 1) line("  final_rates: " + rates());
    if (kind == 2) {
      line("  final_rates: {match: " + any_of<3>({"velocity_least_rates", "velocity", "twist"}) + "}");
    }
    if (waypoint) {
      line(fmt::format("  waypoints: [{{time: {:.3g}, joints: {}, rates: {}}}]", approach_s_ * uniform(0.3, 0.7),
                       positions(), rates()));
    }
    if (mode != "ideal")
      line("  tracking: {mode: " + mode + ", " + (mode == "pd" ? gains() : rates_of_decay()) + noise());
    if (base_mode_ == "free" && percent(15)) line("  " + base_control());
  }
  // Of computed torque, per unit of inertia.
  static std::string rates_of_decay() {
    const double omega = decades(0.3, 10);
    return fmt::format("kp: {:.4g}, kd: {:.4g}", omega * omega, 1.4 * omega);
  }
  static std::string noise() {
    if (!percent(20)) return "}";
    return fmt::format(", noise: {{position: {:.3g}, bandwidth: {:.3g}, seed: {}}}}}", decades(1e-5, 1e-2),
                       uniform(0.5, 5), integer(0, 1000));
  }

  std::string text_;
  double mass_ = 1;  // of the base [kg]; links and targets are measured by it
  std::string base_mode_;
  int arms_ = 1;
  std::vector<std::string> last_links_;
  std::vector<Joint> joints_;  // that move, in the file's order, which is the model's
  int targets_ = 0;
  bool moving_ = false;  // joints have initial rates
  bool impact_ = false;
  double approach_s_ = 0, after_s_ = 0;  // durations; 0: no such phase [s]
  std::vector<bool> envelopes_;          // per arm
  std::vector<double> closes_;           // per grasp: the time it states, else 0 [s]
};

}  // namespace

std::ostream& operator<<(std::ostream& out, const ScenarioText& scenario) {
  return out << "a scenario to save and run:\n" << scenario.yaml;
}

rc::Gen<ScenarioText> scenario_text() {
  return rc::gen::exec([] { return ScenarioText{Writer().scenario()}; });
}

}  // namespace grapnel::testing
