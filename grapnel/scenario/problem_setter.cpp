#include "grapnel/scenario/problem_setter.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "grapnel/scenario/read_robot.hpp"
#include "grapnel/scenario/schema_place.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Steps = std::span<const PathStep>;
using Numbers = std::span<const double>;

constexpr double kLargestWhole = 9007199254740991;  // the schema's, of seeds

// Finds the way from steps of a path to fields of a problem. Every function returns null for a way it does not know.
class Finder {
 public:
  Finder(const Node& form, const CaptureProblem& problem, const PlaceRule& rule)
      : form_(form), problem_(problem), rule_(rule) {}

  ProblemSetter find(Steps at) const {
    if (at.empty() || at[0].is_index) return nullptr;
    const std::string& key = at[0].key;
    const Steps rest = at.subspan(1);
    if (key == "targets")
      return rest.size() >= 2 && rest[0].is_index ? target(rest[0].index, rest.subspan(1)) : nullptr;
    if (key == "grasps") return rest.size() >= 2 && rest[0].is_index ? grasp(rest[0].index, rest.subspan(1)) : nullptr;
    if (key == "initial") return initial(rest);
    if (key == "robot") return robot(rest);
    if (key == "approach") return problem_.approach ? approach(rest) : nullptr;
    if (key == "impact") return problem_.impact ? impact(rest) : nullptr;
    if (key == "integration") return integration(rest);
    if (key == "contact" && is(rest, {"limit"}))
      return number([](CaptureProblem& p) { return &p.contact.refuse_beyond; });
    if (key == "contact" && is(rest, {"largest_gap"})) {
      return number([](CaptureProblem& p) {
        if (!p.contact.largest_gap) p.contact.largest_gap = 0;
        return &*p.contact.largest_gap;
      });
    }
    if (key == "gravity") return vector(rest, [](CaptureProblem& p) { return &p.gravity; });
    return nullptr;
  }

 private:
  static bool is(Steps at, std::initializer_list<std::string_view> keys) {
    return std::equal(at.begin(), at.end(), keys.begin(), keys.end(),
                      [](const PathStep& step, std::string_view key) { return !step.is_index && step.key == key; });
  }
  static bool is_key(const PathStep& step, std::string_view key) { return !step.is_index && step.key == key; }

  static bool are_within(const PlaceRule& rule, Numbers numbers) {
    return std::all_of(numbers.begin(), numbers.end(), [&](double x) { return std::isfinite(x) && rule.allows(x); });
  }

  // --- Forms ---

  template <class Place>
  ProblemSetter number(Place place) const {
    if (!form_.is_scalar()) return nullptr;
    return [place, rule = rule_](CaptureProblem& problem, Numbers numbers) {
      if (numbers.size() != 1 || !are_within(rule, numbers)) return false;
      *place(problem) = numbers[0];
      return true;
    };
  }

  // A vector, or one component of it.
  template <class Place>
  ProblemSetter vector(Steps rest, Place place) const {
    if (rest.empty() && form_.is_sequence() && form_.items.size() == 3) {
      return [place, rule = rule_](CaptureProblem& problem, Numbers numbers) {
        if (numbers.size() != 3 || !are_within(rule, numbers)) return false;
        *place(problem) = {numbers[0], numbers[1], numbers[2]};
        return true;
      };
    }
    if (rest.size() != 1 || !rest[0].is_index || rest[0].index > 2 || !form_.is_scalar()) return nullptr;
    return [place, rule = rule_, k = static_cast<int>(rest[0].index)](CaptureProblem& problem, Numbers numbers) {
      if (numbers.size() != 1 || !are_within(rule, numbers)) return false;
      (*place(problem))[k] = numbers[0];
      return true;
    };
  }

  template <class Place>
  ProblemSetter quaternion(Steps rest, Place place) const {
    if (!rest.empty() || !form_.is_sequence() || form_.items.size() != 4) return nullptr;
    return [place](CaptureProblem& problem, Numbers v) {
      if (v.size() != 4) return false;
      const auto R = rotation_from_wxyz(v.first<4>());
      if (R) *place(problem) = *R;
      return R.has_value();
    };
  }

  static double* component(Symmetric3d& I, std::string_view name) {
    if (name == "xx") return &I.xx;
    if (name == "yy") return &I.yy;
    if (name == "zz") return &I.zz;
    if (name == "xy") return &I.xy;
    if (name == "xz") return &I.xz;
    return name == "yz" ? &I.yz : nullptr;
  }

  // The tensor as a list of 3 or 6, as a mapping, or one number of these.
  template <class Place>
  ProblemSetter inertia(Steps rest, Place place) const {
    constexpr std::string_view kOrder[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
    std::vector<std::string> names;
    if (rest.empty() && form_.is_sequence() && !form_.items.empty() && form_.items[0].is_sequence()) return nullptr;
    if (rest.empty() && form_.is_sequence() && (form_.items.size() == 3 || form_.items.size() == 6)) {
      for (std::size_t i = 0; i < form_.items.size(); ++i) names.emplace_back(kOrder[i]);
    } else if (rest.empty() && form_.is_mapping()) {
      for (const NodeEntry& entry : form_.entries) names.push_back(entry.key);
    } else if (rest.size() == 1 && form_.is_scalar()) {
      if (rest[0].is_index && rest[0].index > 5) return nullptr;
      names.push_back(rest[0].is_index ? std::string(kOrder[rest[0].index]) : rest[0].key);
    }
    Symmetric3d unused;
    const auto known = [&](const std::string& name) { return component(unused, name) != nullptr; };
    if (names.empty() || !std::all_of(names.begin(), names.end(), known)) return nullptr;
    return [place, names](CaptureProblem& problem, Numbers numbers) {
      if (numbers.size() != names.size()) return false;
      Symmetric3d& I = *place(problem);
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (!std::isfinite(numbers[i])) return false;
        *component(I, names[i]) = numbers[i];
      }
      return inertia_fault(I).empty();
    };
  }

  // Position and orientation.
  template <class Place>
  ProblemSetter pose(Steps at, Place place) const {
    if (at.empty()) return nullptr;
    if (is_key(at[0], "position")) return vector(at.subspan(1), [place](CaptureProblem& p) { return &place(p)->p; });
    if (is_key(at[0], "quaternion_wxyz"))
      return quaternion(at.subspan(1), [place](CaptureProblem& p) { return &place(p)->R; });
    return nullptr;
  }

  // Values of all joints or of one, within limits that `allows(joint, value)` knows.
  template <class Place, class Allows>
  ProblemSetter joints(Steps rest, Place place, Allows allows) const {
    std::vector<std::size_t> which;
    const std::vector<JointDescription> order = moving_joints();
    const auto add = [&](std::string_view name) {
      for (std::size_t j = 0; j < order.size(); ++j) {
        if (order[j].name == name) which.push_back(j);
      }
    };
    bool all = false;
    if (rest.empty() && form_.is_scalar()) {
      all = true;
    } else if (rest.empty() && form_.is_sequence() && form_.items.size() == order.size()) {
      for (std::size_t j = 0; j < order.size(); ++j) which.push_back(j);
    } else if (rest.empty() && form_.is_mapping()) {
      for (const NodeEntry& entry : form_.entries) add(entry.key);
      if (which.size() != form_.entries.size()) return nullptr;
    } else if (rest.size() == 1 && form_.is_scalar()) {
      if (rest[0].is_index)
        which.push_back(rest[0].index);
      else
        add(rest[0].key);
    }
    if ((which.empty() && !all) || std::any_of(which.begin(), which.end(), [&](auto j) { return j >= order.size(); }))
      return nullptr;
    return [=](CaptureProblem& problem, Numbers numbers) {
      std::vector<double>* values = place(problem);
      if (!values || values->size() != order.size() || numbers.size() != (all ? 1 : which.size())) return false;
      // One number for all is not checked against the joints' limits by the reader either.
      if (all) values->assign(order.size(), numbers[0]);
      for (std::size_t i = 0; i < which.size(); ++i) {
        if (!std::isfinite(numbers[i]) || !allows(order[which[i]].limits, numbers[i])) return false;
        (*values)[which[i]] = numbers[i];
      }
      return std::isfinite(numbers[0]);
    };
  }

  std::vector<JointDescription> moving_joints() const {
    std::vector<JointDescription> order;
    const Model model = build_model(problem_.robot);
    for (const int body : model.joints()) order.push_back(model.bodies()[body].description.joint);
    return order;
  }
  static bool position_allowed(const JointLimits& limits, double x) { return x >= limits.lower && x <= limits.upper; }
  static bool rate_allowed(const JointLimits& limits, double x) { return std::abs(x) <= limits.rate; }

  // --- Parts of the scenario ---

  ProblemSetter target(std::size_t i, Steps at) const {
    const auto self = [i](CaptureProblem& p) { return &p.targets[i]; };
    const Steps rest = at.subspan(1);
    if (is(at, {"mass"})) return number([self](CaptureProblem& p) { return &self(p)->mass; });
    if (is_key(at[0], "com")) return vector(rest, [self](CaptureProblem& p) { return &self(p)->com; });
    if (is_key(at[0], "inertia")) return inertia(rest, [self](CaptureProblem& p) { return &self(p)->inertia; });
    if (is_key(at[0], "state") && !rest.empty()) {
      if (is_key(rest[0], "velocity"))
        return vector(rest.subspan(1), [self](CaptureProblem& p) { return &self(p)->V_WT.linear; });
      if (is_key(rest[0], "angular_velocity"))
        return vector(rest.subspan(1), [self](CaptureProblem& p) { return &self(p)->V_WT.angular; });
      return pose(rest, [self](CaptureProblem& p) { return &self(p)->X_WT; });
    }
    if (is_key(at[0], "grasp_points") && rest.size() >= 2 && rest[0].is_index) {
      return pose(rest.subspan(1),
                  [self, k = rest[0].index](CaptureProblem& p) { return &self(p)->grasp_points[k].X_TG; });
    }
    return nullptr;
  }

  ProblemSetter grasp(std::size_t i, Steps at) const {
    const auto self = [i](CaptureProblem& p) { return &p.grasps[i]; };
    if (is_key(at[0], "relative_velocity"))
      return vector(at.subspan(1), [self](CaptureProblem& p) { return &self(p)->relative_velocity; });
    if (is_key(at[0], "relative_angular_velocity"))
      return vector(at.subspan(1), [self](CaptureProblem& p) { return &self(p)->relative_angular_velocity; });
    return nullptr;
  }

  ProblemSetter initial(Steps at) const {
    if (at.empty()) return nullptr;
    // A stated motion says the initial values too.
    const bool stated = problem_.approach && (problem_.approach->sampled || !problem_.approach->pieces.empty());
    if (is_key(at[0], "joints") && !stated)
      return joints(
          at.subspan(1), [](CaptureProblem& p) { return &p.joint_position; }, position_allowed);
    // With an approach, whether the joints start from rest decides about profiles.
    if (is_key(at[0], "joint_rates") && !problem_.approach && !problem_.joint_rate.empty())
      return joints(
          at.subspan(1), [](CaptureProblem& p) { return &p.joint_rate; }, rate_allowed);
    if (!is_key(at[0], "base") || at.size() < 2 || problem_.robot.base_mode == RobotSetup::Base::fixed) return nullptr;
    const Steps rest = at.subspan(1);
    const bool free = problem_.robot.base_mode == RobotSetup::Base::free;
    if (is_key(rest[0], "velocity") && free && problem_.V_WB)
      return vector(rest.subspan(1), [](CaptureProblem& p) { return &p.V_WB->linear; });
    if (is_key(rest[0], "angular_velocity") && free && problem_.V_WB)
      return vector(rest.subspan(1), [](CaptureProblem& p) { return &p.V_WB->angular; });
    if (is_key(rest[0], "momentum") && rest.size() >= 2 && free && problem_.momentum) {
      if (is_key(rest[1], "linear"))
        return vector(rest.subspan(2), [](CaptureProblem& p) { return &p.momentum->linear; });
      if (is_key(rest[1], "angular"))
        return vector(rest.subspan(2), [](CaptureProblem& p) { return &p.momentum->angular; });
    }
    return pose(rest, [](CaptureProblem& p) { return &p.X_WB; });
  }

  // Mass, centre of mass and inertia of the base and of links; joints' friction.
  ProblemSetter robot(Steps at) const {
    std::size_t body = 0;
    Steps rest;
    if (at.size() >= 2 && is_key(at[0], "base")) {
      rest = at.subspan(1);
    } else if (at.size() >= 3 && is_key(at[0], "links") && at[1].is_index) {
      body = 1 + at[1].index;  // the reader puts the base first, then the links in the file's order
      rest = at.subspan(2);
    } else {
      return nullptr;
    }
    if (body >= problem_.robot.bodies.size()) return nullptr;
    const auto self = [body](CaptureProblem& p) { return &p.robot.bodies[body]; };
    if (is(rest, {"mass"})) return number([self](CaptureProblem& p) { return &self(p)->mass; });
    if (is_key(rest[0], "com")) return vector(rest.subspan(1), [self](CaptureProblem& p) { return &self(p)->com; });
    if (is_key(rest[0], "inertia"))
      return inertia(rest.subspan(1), [self](CaptureProblem& p) { return &self(p)->inertia; });
    if (body > 0 && is(rest, {"joint", "friction", "viscous"}))
      return number([self](CaptureProblem& p) { return &self(p)->joint.friction.viscous; });
    if (body > 0 && is(rest, {"joint", "friction", "coulomb"}))
      return number([self](CaptureProblem& p) { return &self(p)->joint.friction.coulomb; });
    return nullptr;
  }

  ProblemSetter approach(Steps at) const {
    if (at.empty()) return nullptr;
    const ApproachSetup& now = *problem_.approach;
    if (is_key(at[0], "final_joints") && !now.final_position.empty())
      return joints(
          at.subspan(1), [](CaptureProblem& p) { return &p.approach->final_position; }, position_allowed);
    if (is_key(at[0], "final_rates") && now.final_rates)
      return joints(
          at.subspan(1), [](CaptureProblem& p) { return &*p.approach->final_rates; }, rate_allowed);
    if (!is_key(at[0], "tracking") || at.size() < 2) return nullptr;
    const Steps rest = at.subspan(1);
    const auto any = [](const JointLimits&, double) { return true; };
    if (is_key(rest[0], "kp") && !now.tracking.kp.empty())
      return gains(
          rest.subspan(1), [](CaptureProblem& p) { return &p.approach->tracking.kp; }, any);
    if (is_key(rest[0], "kd") && !now.tracking.kd.empty())
      return gains(
          rest.subspan(1), [](CaptureProblem& p) { return &p.approach->tracking.kd; }, any);
    if (!now.tracking.noise) return nullptr;
    const auto noise = [](CaptureProblem& p) { return &*p.approach->tracking.noise; };
    if (is(rest, {"noise", "position"})) return number([noise](CaptureProblem& p) { return &noise(p)->position; });
    if (is(rest, {"noise", "bandwidth"})) return number([noise](CaptureProblem& p) { return &noise(p)->bandwidth; });
    if (is(rest, {"noise", "seed"}) && form_.is_scalar()) {
      return [noise](CaptureProblem& problem, Numbers numbers) {
        if (numbers.size() != 1 || !(numbers[0] >= 0 && numbers[0] <= kLargestWhole)) return false;
        if (numbers[0] != std::floor(numbers[0])) return false;
        noise(problem)->seed = static_cast<std::uint64_t>(numbers[0]);
        return true;
      };
    }
    return nullptr;
  }

  // Like joints, within the range that the schema says.
  template <class Place, class Allows>
  ProblemSetter gains(Steps rest, Place place, Allows allows) const {
    ProblemSetter set = joints(rest, place, allows);
    if (!set) return nullptr;
    return [set, rule = rule_](CaptureProblem& problem, Numbers numbers) {
      return are_within(rule, numbers) && set(problem, numbers);
    };
  }

  ProblemSetter impact(Steps at) const {
    const auto self = [](CaptureProblem& p) { return &*p.impact; };
    if (is(at, {"restitution"}) && form_.is_scalar()) {
      return [self, rule = rule_](CaptureProblem& problem, Numbers numbers) {
        if (numbers.size() != 1 || !are_within(rule, numbers)) return false;
        self(problem)->restitution = self(problem)->angular_restitution = numbers[0];
        return true;
      };
    }
    const auto at_contact = [self](double ContactComplianceSetup::*field) {
      return [self, field](CaptureProblem& p) { return &(self(p)->contact.*field); };
    };
    const auto at_grip = [self](double GripComplianceSetup::*field) {
      return [self, field](CaptureProblem& p) { return &(self(p)->grip.*field); };
    };
    if (is(at, {"duration"})) return number([self](CaptureProblem& p) { return &self(p)->duration; });
    if (is(at, {"friction"})) return number([self](CaptureProblem& p) { return &self(p)->friction; });
    if (is(at, {"restitution", "linear"})) return number([self](CaptureProblem& p) { return &self(p)->restitution; });
    if (is(at, {"restitution", "angular"}))
      return number([self](CaptureProblem& p) { return &self(p)->angular_restitution; });
    if (is(at, {"contact", "stiffness"})) return number(at_contact(&ContactComplianceSetup::stiffness));
    if (is(at, {"contact", "damping"})) return number(at_contact(&ContactComplianceSetup::damping));
    if (is(at, {"grip", "linear_stiffness"})) return number(at_grip(&GripComplianceSetup::linear_stiffness));
    if (is(at, {"grip", "linear_damping"})) return number(at_grip(&GripComplianceSetup::linear_damping));
    if (is(at, {"grip", "angular_stiffness"})) return number(at_grip(&GripComplianceSetup::angular_stiffness));
    if (is(at, {"grip", "angular_damping"})) return number(at_grip(&GripComplianceSetup::angular_damping));
    return nullptr;
  }

  ProblemSetter integration(Steps at) const {
    const auto field = [&](double IntegrationSetup::*which) {
      return number([which](CaptureProblem& p) { return &(p.integration.*which); });
    };
    if (is(at, {"relative_tolerance"})) return field(&IntegrationSetup::relative_tolerance);
    if (is(at, {"absolute_tolerance"})) return field(&IntegrationSetup::absolute_tolerance);
    if (is(at, {"baumgarte_time"})) return field(&IntegrationSetup::baumgarte_time);
    return nullptr;
  }

  const Node& form_;
  const CaptureProblem& problem_;
  const PlaceRule& rule_;
};

}  // namespace

ProblemSetter problem_setter(std::span<const PathStep> steps, const Node& form, const CaptureProblem& problem) {
  if (!numbers_in(form)) return nullptr;
  const PlaceRule rule = place_rule(steps);
  if (!rule.is_known) return nullptr;
  return Finder(form, problem, rule).find(steps);
}

}  // namespace grapnel
