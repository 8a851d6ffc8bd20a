#include "grapnel/scenario/problem_setter.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/scenario/descriptions.hpp"
#include "grapnel/scenario/magnitudes.hpp"
#include "grapnel/scenario/read_robot.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Steps = std::span<const PathStep>;
using Numbers = std::span<const double>;

// From a value to a part of it; null where the problem has no such part.
using Hop = std::function<void*(CaptureProblem&, void*)>;
// Puts numbers at the end of the way. False if the reader might refuse them.
using Writer = std::function<bool(CaptureProblem&, void*, Numbers)>;

bool is_index(Steps at) { return !at.empty() && at[0].is_index; }

// The numbers that a field may have, by its range and its unit.
bool allows(const Field& field, double x) {
  const Magnitudes of_unit = magnitudes_of(field.unit);
  const double largest = std::isnan(field.largest) ? of_unit.largest : field.largest;
  const bool is_positive = field.range.least_excluded && field.range.least == 0;
  return std::isfinite(x) && field.range.contains(x) && std::abs(x) <= largest &&
         !(is_positive && x < of_unit.smallest);
}
bool allows(const Field& field, Numbers numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [&](double x) { return allows(field, x); });
}

template <class Named>
Named* with_name(std::vector<std::pair<std::string, Named>>& list, const std::string& name) {
  for (auto& [key, value] : list) {
    if (key == name) return &value;
  }
  return nullptr;
}

// ---- Values in forms of their own. `rest` is what of the path is left below the field. ----

struct Place {
  const Field& field;
  const Node& form;               // what stands there
  const CaptureProblem& problem;  // as it was read
  Steps rest;
  const void* value;  // where it stands in that problem
};

// Writers of the components `which` of a list-like value, or of all.
std::optional<std::vector<std::size_t>> components(const Place& at, std::size_t count) {
  std::vector<std::size_t> which;
  if (at.rest.empty() && at.form.is_sequence() && at.form.items.size() == count) {
    for (std::size_t i = 0; i < count; ++i) which.push_back(i);
  } else if (at.rest.size() == 1 && is_index(at.rest) && at.rest[0].index < count && at.form.is_scalar()) {
    which.push_back(at.rest[0].index);
  }
  if (which.empty()) return {};
  return which;
}

Writer number(const Place& at) {
  if (!at.rest.empty() || !at.form.is_scalar()) return nullptr;
  return [field = at.field](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != 1 || !allows(field, numbers)) return false;
    *static_cast<double*>(place) = numbers[0];
    return true;
  };
}

Writer whole_number(const Place& at) {
  if (!at.rest.empty() || !at.form.is_scalar()) return nullptr;
  const Type& type = at.field.type();
  return [field = at.field, set = type.set_whole](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != 1 || !allows(field, numbers) || numbers[0] != std::floor(numbers[0])) return false;
    set(place, static_cast<std::int64_t>(numbers[0]));
    return true;
  };
}

// Three numbers, or one of them.
Writer vector(const Place& at) {
  const auto which = components(at, 3);
  if (!which) return nullptr;
  const bool is_unit = at.field.form == "unit vector";
  return [field = at.field, which = *which, is_unit](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != which.size() || !allows(field, numbers)) return false;
    Vector3d& v = *static_cast<Vector3d*>(place);
    for (std::size_t i = 0; i < which.size(); ++i) v[static_cast<int>(which[i])] = numbers[i];
    return !is_unit || std::abs(std::hypot(v[0], v[1], v[2]) - 1) < 1e-9;  // as unit_vector_at()
  };
}

Writer quaternion(const Place& at) {
  if (!at.rest.empty() || !at.form.is_sequence() || at.form.items.size() != 4) return nullptr;
  return [](CaptureProblem&, void* place, Numbers v) {
    if (v.size() != 4) return false;
    const auto R = rotation_from_wxyz(v.first<4>());
    if (R) *static_cast<Rotationd*>(place) = *R;
    return R.has_value();
  };
}

Writer rpy(const Place& at) {
  if (!at.rest.empty() || !at.form.is_sequence() || at.form.items.size() != 3) return nullptr;
  return [field = at.field](CaptureProblem&, void* place, Numbers v) {
    if (v.size() != 3 || !allows(field, v)) return false;
    *static_cast<Rotationd*>(place) = rotation_from_rpy(v[0], v[1], v[2]);
    return true;
  };
}

double* component(Symmetric3d& I, std::string_view name) {
  const std::pair<std::string_view, double*> all[] = {{"xx", &I.xx}, {"yy", &I.yy}, {"zz", &I.zz},
                                                      {"xy", &I.xy}, {"xz", &I.xz}, {"yz", &I.yz}};
  for (const auto& [key, value] : all) {
    if (key == name) return value;
  }
  return nullptr;
}

// The tensor as a list of 3 or 6, as a mapping, or one number of these.
Writer inertia(const Place& at) {
  constexpr std::string_view kOrder[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
  std::vector<std::string> names;
  if (at.rest.empty() && at.form.is_sequence() && (at.form.items.size() == 3 || at.form.items.size() == 6)) {
    for (std::size_t i = 0; i < at.form.items.size(); ++i) names.emplace_back(kOrder[i]);
    if (at.form.items[0].is_sequence()) return nullptr;  // a matrix
  } else if (at.rest.empty() && at.form.is_mapping()) {
    for (const NodeEntry& entry : at.form.entries) names.push_back(entry.key);
  } else if (at.rest.size() == 1 && at.form.is_scalar()) {
    if (at.rest[0].is_index && at.rest[0].index > 5) return nullptr;
    names.push_back(at.rest[0].is_index ? std::string(kOrder[at.rest[0].index]) : at.rest[0].key);
  }
  Symmetric3d unused = Symmetric3d::zero();
  const auto known = [&](const std::string& name) { return component(unused, name) != nullptr; };
  if (names.empty() || !std::all_of(names.begin(), names.end(), known)) return nullptr;
  return [field = at.field, names](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != names.size() || !allows(field, numbers)) return false;
    Symmetric3d& I = *static_cast<Symmetric3d*>(place);
    for (std::size_t i = 0; i < names.size(); ++i) *component(I, names[i]) = numbers[i];
    return inertia_fault(I).empty();
  };
}

std::vector<JointDescription> moving_joints(const CaptureProblem& problem) {
  std::vector<JointDescription> order;
  const Model model = build_model(problem.robot);
  for (const int body : model.joints()) order.push_back(model.bodies()[body].description.joint);
  return order;
}

// The joints whose values the form says, in its order; nothing for a number for all.
std::optional<std::vector<std::size_t>> joints_of(const Place& at, const std::vector<JointDescription>& order) {
  std::vector<std::size_t> which;
  const auto add = [&](std::string_view name) {
    for (std::size_t j = 0; j < order.size(); ++j) {
      if (order[j].name == name) which.push_back(j);
    }
  };
  if (at.rest.empty() && at.form.is_scalar()) return which;
  if (at.rest.empty() && at.form.is_sequence() && at.form.items.size() == order.size()) {
    for (std::size_t j = 0; j < order.size(); ++j) which.push_back(j);
  } else if (at.rest.empty() && at.form.is_mapping()) {
    for (const NodeEntry& entry : at.form.entries) add(entry.key);
    if (which.size() != at.form.entries.size()) return {};
  } else if (at.rest.size() == 1 && at.form.is_scalar()) {
    if (at.rest[0].is_index)
      which.push_back(at.rest[0].index);
    else
      add(at.rest[0].key);
  }
  if (which.empty() || std::any_of(which.begin(), which.end(), [&](auto j) { return j >= order.size(); })) return {};
  return which;
}

// Values of all joints or of some. Positions and rates keep to the joints' limits, gains do not know them.
Writer joint_values(const Place& at) {
  enum class Limits { none, position, rate };
  const Limits limits = at.field.form == "gains"             ? Limits::none
                        : at.field.unit.starts_with("rad/s") ? Limits::rate
                                                             : Limits::position;
  const bool is_read = !static_cast<const std::vector<double>*>(at.value)->empty();
  const std::vector<JointDescription> order = moving_joints(at.problem);
  const auto which = joints_of(at, order);
  if (!which || (which->empty() && limits != Limits::none)) return nullptr;
  return [=, field = at.field, which = *which](CaptureProblem&, void* place, Numbers numbers) {
    auto& values = *static_cast<std::vector<double>*>(place);
    const bool all = which.empty();
    if (numbers.size() != (all ? 1 : which.size()) || !allows(field, numbers)) return false;
    if (!is_read) return true;  // gains of joints that follow exactly: nobody reads them
    if (values.size() != order.size()) return false;
    if (all) values.assign(order.size(), numbers[0]);
    for (std::size_t i = 0; i < which.size(); ++i) {
      const JointLimits& limit = order[which[i]].limits;
      if (limits == Limits::position && !(numbers[i] >= limit.lower && numbers[i] <= limit.upper)) return false;
      if (limits == Limits::rate && !(std::abs(numbers[i]) <= limit.rate)) return false;
      values[which[i]] = numbers[i];
    }
    return true;
  };
}

// A number for all axes, three, or one of three.
Writer axis_gains(const Place& at) {
  if (!at.rest.empty() || !at.form.is_scalar()) return vector(at);
  return [field = at.field](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != 1 || !allows(field, numbers)) return false;
    *static_cast<Vector3d*>(place) = {numbers[0], numbers[0], numbers[0]};
    return true;
  };
}

// A number for all rows, or {linear: e, angular: e}, or one of these.
Writer restitution(const Place& at) {
  std::vector<std::string> keys;
  if (at.rest.empty() && at.form.is_mapping()) {
    for (const NodeEntry& entry : at.form.entries) keys.push_back(entry.key);
  } else if (at.rest.size() == 1 && !at.rest[0].is_index) {
    keys.push_back(at.rest[0].key);
  } else if (!at.rest.empty() || !at.form.is_scalar()) {
    return nullptr;
  }
  return [field = at.field, keys](CaptureProblem& problem, void*, Numbers numbers) {
    ImpactSetup& impact = *problem.impact;
    if (numbers.size() != std::max<std::size_t>(keys.size(), 1) || !allows(field, numbers)) return false;
    if (keys.empty()) impact.restitution = impact.angular_restitution = numbers[0];
    for (std::size_t i = 0; i < keys.size(); ++i)
      (keys[i] == "angular" ? impact.angular_restitution : impact.restitution) = numbers[i];
    return true;
  };
}

// Of a mesh, along all axes.
Writer scale(const Place& at) {
  if (!at.rest.empty() || !at.form.is_scalar()) return nullptr;
  return [field = at.field](CaptureProblem&, void* place, Numbers numbers) {
    if (numbers.size() != 1 || !allows(field, numbers)) return false;
    double* size = static_cast<double*>(place);
    size[0] = size[1] = size[2] = numbers[0];
    return true;
  };
}

// One number of a row [t, Fx, Fy, Fz, Mx, My, Mz].
Hop load_row(std::size_t row, std::size_t column) {
  return [=](CaptureProblem&, void* values) -> void* {
    Wrenchd& wrench = (*static_cast<std::vector<Wrenchd>*>(values))[row];
    return column < 4 ? &wrench.linear[static_cast<int>(column - 1)] : &wrench.angular[static_cast<int>(column - 4)];
  };
}

Writer writer_of(const Place& at) {
  using Make = Writer (*)(const Place&);
  static const std::map<std::string_view, Make> kForms{{"quaternion", quaternion},     {"rpy", rpy},
                                                       {"inertia", inertia},           {"unit vector", vector},
                                                       {"joint values", joint_values}, {"gains", joint_values},
                                                       {"final rates", joint_values},  {"axis gains", axis_gains},
                                                       {"restitution", restitution},   {"scale", scale},
                                                       {"number or any", number},      {"number or infinity", number}};
  if (!at.field.form.empty()) {
    const auto found = kForms.find(at.field.form);
    return found == kForms.end() ? nullptr : found->second(at);
  }
  const Type* type = &at.field.type();
  if (type->kind == Type::Kind::optional) type = &type->of();
  if (type->kind == Type::Kind::real) return number(at);
  if (type->kind == Type::Kind::whole) return whole_number(at);
  if (type->kind == Type::Kind::list && type->fixed_size == 3) return vector(at);
  return nullptr;
}

// ---- Parts that stand elsewhere in the problem than in the file ----

// A rating or shape of the body that the way has come to, which the robot keeps in lists by name.
Hop kept_by_name(const Field& field, bool of_base) {
  const bool is_rating = field.form == "joint rating";
  return [=](CaptureProblem& problem, void* owner) -> void* {
    RobotSetup& robot = problem.robot;
    const BodyDescription& body = of_base ? robot.bodies.at(0) : *static_cast<const BodyDescription*>(owner);
    if (is_rating) return with_name(robot.ratings, body.joint.name);
    return with_name(robot.geometry, body.name);
  };
}

// The place of an end-effector of a waypoint.
Hop place_named(const std::string& name) {
  return [name](CaptureProblem&, void* list) -> void* {
    for (Waypoint::Place& place : *static_cast<std::vector<Waypoint::Place>*>(list)) {
      if (place.end_effector == name) return &place;
    }
    return nullptr;
  };
}

// Follows a path through the descriptions and the problem.
class Finder {
 public:
  Finder(const Node& form, const CaptureProblem& problem) : form_(form), problem_(problem), copy_(problem) {}

  ProblemSetter find(Steps steps) {
    at_ = &copy_;
    const Writer writer = find(scenario_description(), steps);
    if (!writer) return nullptr;
    const bool is_limit = std::any_of(steps.begin(), steps.end(), [](const PathStep& s) { return s.key == "limits"; });
    return [is_limit, hops = std::move(hops_), writer](CaptureProblem& problem, Numbers numbers) {
      void* at = &problem;
      for (const Hop& hop : hops) {
        at = hop(problem, at);
        if (!at) return false;
      }
      return writer(problem, at, numbers) && settle(problem) && (!is_limit || keeps_limits(problem));
    };
  }

 private:
  // What the reader does with a whole problem: false if it may refuse it.
  static bool settle(CaptureProblem& problem) {
    RobotSetup& robot = problem.robot;
    if (robot.base_mode == RobotSetup::Base::fixed) robot.bodies.at(0).X_PF = problem.X_WB;
    const auto is_zero = [](const Vector3d& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; };
    if (robot.base_mode != RobotSetup::Base::free && problem.V_WB &&
        !(is_zero(problem.V_WB->angular) && is_zero(problem.V_WB->linear)))
      return false;
    const auto keeps_digits = [](const auto& body) {  // as check_com()
      return std::min({body.inertia.xx, body.inertia.yy, body.inertia.zz}) >=
             1e-12 * body.mass * dot(body.com, body.com);
    };
    return std::all_of(robot.bodies.begin(), robot.bodies.end(), keeps_digits) &&
           std::all_of(problem.targets.begin(), problem.targets.end(), keeps_digits) &&
           problem_conflicts(problem).empty();
  }

  // Whether joint values and rates are still within limits that were changed, and limits in order.
  static bool keeps_limits(const CaptureProblem& problem) {
    const std::vector<JointDescription> order = moving_joints(problem);
    const auto are_within = [&](const std::vector<double>& values, bool rates) {
      for (std::size_t j = 0; j < values.size(); ++j) {
        const JointLimits& limit = order.at(j).limits;
        if (rates ? !(std::abs(values[j]) <= limit.rate) : !(values[j] >= limit.lower && values[j] <= limit.upper))
          return false;
      }
      return true;
    };
    const auto in_order = [](const JointDescription& joint) { return joint.limits.lower <= joint.limits.upper; };
    bool kept = std::all_of(order.begin(), order.end(), in_order) && are_within(problem.joint_position, false) &&
                are_within(problem.joint_rate, true);
    if (!problem.approach) return kept;
    const ApproachSetup& approach = *problem.approach;
    kept = kept && are_within(approach.final_position, false) &&
           are_within(approach.final_rates.value_or(std::vector<double>{}), true) &&
           (!approach.plan || are_within(approach.plan->guess, false));
    for (const Waypoint& waypoint : approach.waypoints) {
      kept = kept && are_within(waypoint.joints, false) &&
             are_within(waypoint.rates.value_or(std::vector<double>{}), true);
    }
    return kept;
  }

  bool hop(Hop next) {
    at_ = next(copy_, at_);
    hops_.push_back(std::move(next));
    return at_ != nullptr;
  }

  // A stated motion says the initial values and the duration too, and must go on agreeing with them.
  bool is_stated() const {
    return problem_.approach && (problem_.approach->sampled || !problem_.approach->pieces.empty());
  }
  bool must_agree(const Type& owner, const Field& field) const {
    if (owner.name == "piece") return true;
    const bool has_meaning = field.key == "origin" || field.key == "rating";
    if (owner.name == "joint" && !has_meaning &&
        static_cast<const BodyDescription*>(at_)->joint.type == JointType::fixed)
      return true;                                     // its keys have no meaning
    if (owner.name == "grasp" && field.key == "axis")  // read of hinges only
      return static_cast<const GraspSetup*>(at_)->model != GraspModel::hinge;
    const bool is_said_too = (owner.name == "initial" && field.key != "base") ||
                             (owner.name == "approach" && field.key == "duration") || owner.name == "joint_limits";
    return is_stated() && is_said_too;
  }

  Writer find(const Type& type, Steps steps) {
    if (type.kind == Type::Kind::optional) {
      const bool is_there =
          hop([&type](CaptureProblem&, void* at) { return type.size(at) ? type.item(at, 0) : nullptr; });
      return is_there ? find(type.of(), steps) : nullptr;
    }
    if (type.kind == Type::Kind::list && is_index(steps)) {
      const std::size_t i = steps[0].index;
      const bool is_there =
          hop([&type, i](CaptureProblem&, void* at) { return i < type.size(at) ? type.item(at, i) : nullptr; });
      return is_there ? find(type.of(), steps.subspan(1)) : nullptr;
    }
    if (type.kind != Type::Kind::structure || steps.empty() || steps[0].is_index) return nullptr;
    const Field* field = field_named(type, steps[0].key);
    return field && !must_agree(type, *field) ? find(type, *field, steps.subspan(1)) : nullptr;
  }

  Writer find(const Type& owner, const Field& field, Steps rest) {
    if (field.form == "joint rating" || field.form == "geometry of body")
      return hop(kept_by_name(field, owner.name == "base")) ? find(field.type(), rest) : nullptr;
    if (!field.place || !hop([&field](CaptureProblem&, void* at) { return field.place(at); })) return nullptr;
    if (field.form == "places by end-effector")
      return !rest.empty() && !rest[0].is_index && hop(place_named(rest[0].key))
                 ? find(field.type().of(), rest.subspan(1))
                 : nullptr;
    if (field.form == "load table") return find_in_table(field, rest);
    const bool is_within = field.form.empty() && is_structured(field.type());
    if (is_within || field.form == "robot") return find(field.type(), rest);
    if (field.type().kind == Type::Kind::optional && !enter(field.type())) return nullptr;
    return writer_of({field, form_, problem_, rest, at_});
  }

  // Whether keys or items of their own are below.
  static bool is_structured(const Type& type) {
    const Type& inner = type.kind == Type::Kind::optional ? type.of() : type;
    return inner.kind == Type::Kind::structure ||
           (inner.kind == Type::Kind::list && inner.of().kind == Type::Kind::structure);
  }

  // What the optional holds; where it is absent the reader has it put there.
  bool enter(const Type& type) {
    return hop([&type](CaptureProblem&, void* at) {
      if (type.size(at) == 0) type.resize(at, 1);
      return type.item(at, 0);
    });
  }

  Writer find_in_table(const Field& field, Steps rest) {
    if (rest.size() != 2 || !is_index(rest) || !rest[1].is_index || rest[1].index > 6 || !form_.is_scalar())
      return nullptr;
    if (rest[1].index == 0 || rest[0].index >= field.type().size(at_)) return nullptr;  // times: by reading
    hop(load_row(rest[0].index, rest[1].index));
    return number({field, form_, problem_, {}, at_});
  }

  const Node& form_;
  const CaptureProblem& problem_;
  CaptureProblem copy_;  // to see where the way leads
  void* at_ = nullptr;
  std::vector<Hop> hops_;
};

// A mapping of numbers, one after the other.
ProblemSetter setter_of_all(Steps steps, const Node& form, const CaptureProblem& problem) {
  std::vector<ProblemSetter> setters;
  for (const NodeEntry& entry : form.entries) {
    std::vector<PathStep> below(steps.begin(), steps.end());
    below.push_back({entry.key, 0, false});
    ProblemSetter one = Finder(entry.value, problem).find(below);
    if (!one) return nullptr;
    setters.push_back(std::move(one));
  }
  return [setters](CaptureProblem& changed, Numbers numbers) {
    if (numbers.size() != setters.size()) return false;
    for (std::size_t i = 0; i < setters.size(); ++i) {
      if (!setters[i](changed, numbers.subspan(i, 1))) return false;
    }
    return true;
  };
}

}  // namespace

ProblemSetter problem_setter(std::span<const PathStep> steps, const Node& form, const CaptureProblem& problem) {
  if (!numbers_in(form)) return nullptr;
  if (ProblemSetter found = Finder(form, problem).find(steps)) return found;
  return form.is_mapping() ? setter_of_all(steps, form, problem) : nullptr;
}

}  // namespace grapnel
