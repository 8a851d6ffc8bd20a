#include "grapnel/scenario/problem_setter.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/scenario/joint_values.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Steps = std::span<const PathStep>;
using Numbers = std::span<const double>;

// From a value to a part of it; null if the problem has no such part.
using Hop = std::function<void*(CaptureProblem&, void*)>;

bool is_index(Steps at) { return !at.empty() && at[0].is_index; }

// The value with that name; the index selects among several.
template <class Named>
Named* with_name(std::vector<std::pair<std::string, Named>>& list, const std::string& name, std::size_t index = 0) {
  for (auto& [key, value] : list) {
    if (key == name && index-- == 0) return &value;
  }
  return nullptr;
}

// ---- Parts with different locations in the problem and in the file ----

// The robot stores ratings and shapes in lists by name.
void* rating_of_joint(CaptureProblem& problem, void* owner) {
  return with_name(problem.robot.ratings, static_cast<const BodyDescription*>(owner)->joint.name);
}
Hop shape_of_body(bool of_base, std::size_t index) {
  return [=](CaptureProblem& problem, void* owner) -> void* {
    RobotSetup& robot = problem.robot;
    const BodyDescription& body = of_base ? robot.bodies.at(0) : *static_cast<const BodyDescription*>(owner);
    return with_name(robot.geometry, body.name, index);
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
    const NumberWriter writer = find(scenario_description(), steps);
    if (!writer) return nullptr;
    const bool is_limit = std::any_of(steps.begin(), steps.end(), [](const PathStep& s) { return s.key == "limits"; });
    return [is_limit, hops = std::move(hops_), writer](CaptureProblem& problem, Numbers numbers) {
      void* at = &problem;
      for (const Hop& hop : hops) {
        at = hop(problem, at);
        if (!at) return false;
      }
      return writer(problem, at, numbers) && settle(problem) && (!is_limit || respects_limits(problem));
    };
  }

 private:
  // Checks of the reader on a whole problem: false if it may reject the problem.
  static bool settle(CaptureProblem& problem) {
    RobotSetup& robot = problem.robot;
    if (robot.base_mode == RobotSetup::Base::fixed) robot.bodies.at(0).X_PF = problem.X_WB;
    auto& approach = problem.approach;
    if (approach && approach->window) approach->duration = approach->window->latest;
    return problem_conflicts(problem).empty() && robot_conflicts(robot, {}).empty();
  }

  // Whether joint values and rates are within changed limits.
  static bool respects_limits(const CaptureProblem& problem) {
    const std::vector<JointDescription> order = moving_joints(problem.robot);
    const auto are_within = [&](const std::vector<double>& values, bool rates) {
      for (std::size_t j = 0; j < values.size(); ++j) {
        if (!is_within(order.at(j).limits, values[j], rates)) return false;
      }
      return true;
    };
    bool within = are_within(problem.joint_position, false) && are_within(problem.joint_rate, true);
    for (const PostImpactSetup& phase : problem.post_impact) {
      within = within && (!phase.move || are_within(phase.move->joints, false)) &&
               (!phase.keep_base_attitude || are_within(phase.keep_base_attitude->posture, false));
    }
    if (!problem.approach) return within;
    const ApproachSetup& approach = *problem.approach;
    within = within && are_within(approach.final_position, false) &&
             are_within(approach.final_rates.value_or(std::vector<double>{}), true) &&
             (!approach.plan || are_within(approach.plan->guess, false));
    for (const Waypoint& waypoint : approach.waypoints) {
      within = within && are_within(waypoint.joints, false) &&
               are_within(waypoint.rates.value_or(std::vector<double>{}), true);
    }
    return within;
  }

  bool hop(Hop next) {
    at_ = next(copy_, at_);
    hops_.push_back(std::move(next));
    return at_ != nullptr;
  }

  // A stated motion also defines the initial values and the duration, and must agree with them.
  bool is_stated() const {
    return problem_.approach && (problem_.approach->sampled || !problem_.approach->pieces.empty());
  }
  bool must_agree(const Type& owner, const Field& field) const {
    if (owner.name == "piece") return true;
    const bool has_meaning = field.key == "origin" || field.key == "rating";
    if (owner.name == "joint" && !has_meaning &&
        static_cast<const BodyDescription*>(at_)->joint.type == JointType::fixed)
      return true;  // its keys have no meaning
    const bool is_defined_by_motion = (owner.name == "initial" && field.key != "base") ||
                                      (owner.name == "approach" && field.key == "duration") ||
                                      owner.name == "joint_limits";
    const bool is_searched = owner.name == "approach" && field.key == "duration" && problem_.approach->window;
    return (is_stated() && is_defined_by_motion) || is_searched;
  }

  NumberWriter find(const Type& type, Steps steps) {
    if (type.kind == Type::Kind::optional) {
      const bool is_there =
          hop([&type](CaptureProblem&, void* at) { return type.size(at) ? type.item(at, 0) : nullptr; });
      return is_there ? find(type.of(), steps) : nullptr;
    }
    if (type.kind == Type::Kind::list && is_index(steps)) return find_item(type, steps[0].index, steps.subspan(1));
    if (type.kind != Type::Kind::structure || steps.empty() || steps[0].is_index) return nullptr;
    const Field* field = field_named(type, steps[0].key);
    return field && !must_agree(type, *field) ? find(type, *field, steps.subspan(1)) : nullptr;
  }

  NumberWriter find_item(const Type& list, std::size_t i, Steps below) {
    const bool is_there =
        hop([&list, i](CaptureProblem&, void* at) { return i < list.size(at) ? list.item(at, i) : nullptr; });
    return is_there ? find(list.of(), below) : nullptr;
  }

  NumberWriter find(const Type& owner, const Field& field, Steps rest) {
    if (field.form == "joint rating") return hop(rating_of_joint) ? find(field.type(), rest) : nullptr;
    if (field.form == "geometry of body") {
      const bool is_listed = is_index(rest);
      if (!hop(shape_of_body(owner.name == "base", is_listed ? rest[0].index : 0))) return nullptr;
      return find(field.type().of(), is_listed ? rest.subspan(1) : rest);
    }
    const void* const owner_at = at_;
    if (!field.place || !hop([&field](CaptureProblem&, void* at) { return field.place(at); })) return nullptr;
    if (field.is_one_or_list && !is_index(rest)) return find_item(field.type(), 0, rest);
    if (field.form == "places by end-effector")
      return !rest.empty() && !rest[0].is_index && hop(place_named(rest[0].key))
                 ? find(field.type().of(), rest.subspan(1))
                 : nullptr;
    const bool is_below = field.form.empty() && is_structured(field.type());
    if (is_below || field.form == "robot") return find(field.type(), rest);
    const bool is_read = !field.is_present || field.is_present(owner_at);
    if (is_read && field.type().kind == Type::Kind::optional && !enter(field.type())) return nullptr;
    const Form* form = form_of(field);
    if (!form || !form->numbers) return nullptr;
    if (is_read) return form->numbers({field, form_, problem_, rest, at_});
    return [&field](CaptureProblem&, void*, Numbers numbers) { return allows(field, numbers); };  // not used
  }

  // Whether there are keys or items below.
  static bool is_structured(const Type& type) {
    const Type& inner = type.kind == Type::Kind::optional ? type.of() : type;
    return inner.kind == Type::Kind::structure ||
           (inner.kind == Type::Kind::list && inner.of().kind == Type::Kind::structure);
  }

  // The value of the optional; if it is absent, only the reader creates it.
  bool enter(const Type& type) {
    return hop([&type](CaptureProblem&, void* at) {
      if (type.size(at) == 0) type.resize(at, 1);
      return type.item(at, 0);
    });
  }

  const Node& form_;
  const CaptureProblem& problem_;
  CaptureProblem copy_;  // to resolve the path
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

// ---- The members of plain structures, enumerated by the compiler ----

namespace member_counting {
// Converts to any member type; never called.
struct Anything {
  template <class T>
  operator T&() const noexcept;
};
}  // namespace member_counting

namespace {

using member_counting::Anything;

// Number of members of an aggregate: as many as can be initialized. A base class counts as one.
template <class T, class... Some>
consteval std::size_t member_count() {
  if constexpr (requires { T{Some{}..., Anything{}}; })
    return member_count<T, Some..., Anything>();
  else
    return sizeof...(Some);
}

// Calls visit(member, member, ...).
template <class T, class Visit>
void with_members(const T& value, Visit visit) {
  constexpr std::size_t kCount = member_count<T>();
  // clang-format off
#define GRAPNEL_MEMBERS(count, ...)        \
  if constexpr (kCount == count) {         \
    const auto& [__VA_ARGS__] = value;     \
    visit(__VA_ARGS__);                    \
  } else
  GRAPNEL_MEMBERS(1, a)
  GRAPNEL_MEMBERS(2, a, b)
  GRAPNEL_MEMBERS(3, a, b, c)
  GRAPNEL_MEMBERS(4, a, b, c, d)
  GRAPNEL_MEMBERS(5, a, b, c, d, e)
  GRAPNEL_MEMBERS(6, a, b, c, d, e, f)
  GRAPNEL_MEMBERS(7, a, b, c, d, e, f, g)
  GRAPNEL_MEMBERS(8, a, b, c, d, e, f, g, h)
  GRAPNEL_MEMBERS(9, a, b, c, d, e, f, g, h, i)
  GRAPNEL_MEMBERS(10, a, b, c, d, e, f, g, h, i, j)
  GRAPNEL_MEMBERS(11, a, b, c, d, e, f, g, h, i, j, k)
  GRAPNEL_MEMBERS(12, a, b, c, d, e, f, g, h, i, j, k, l)
  GRAPNEL_MEMBERS(13, a, b, c, d, e, f, g, h, i, j, k, l, m)
  GRAPNEL_MEMBERS(14, a, b, c, d, e, f, g, h, i, j, k, l, m, n)
  GRAPNEL_MEMBERS(15, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o)
  GRAPNEL_MEMBERS(16, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p)
  GRAPNEL_MEMBERS(17, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q)
  GRAPNEL_MEMBERS(18, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r)
  GRAPNEL_MEMBERS(19, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s)
  GRAPNEL_MEMBERS(20, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t)
  GRAPNEL_MEMBERS(21, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u)
  GRAPNEL_MEMBERS(22, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v)
  GRAPNEL_MEMBERS(23, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w)
  GRAPNEL_MEMBERS(24, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x)
  GRAPNEL_MEMBERS(25, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y)
  GRAPNEL_MEMBERS(26, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z)
  GRAPNEL_MEMBERS(27, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa)
  GRAPNEL_MEMBERS(28, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb)
  GRAPNEL_MEMBERS(29, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc)
  GRAPNEL_MEMBERS(30, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd)
  GRAPNEL_MEMBERS(31, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee)
  GRAPNEL_MEMBERS(32, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee, ff)
  GRAPNEL_MEMBERS(33, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee, ff, gg)
  GRAPNEL_MEMBERS(34, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee, ff, gg, hh)
  GRAPNEL_MEMBERS(35, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee, ff, gg, hh, ii)
  GRAPNEL_MEMBERS(36, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, aa, bb, cc, dd, ee, ff, gg, hh, ii, jj)
  { static_assert(kCount == 0, "too many members for this list"); }
#undef GRAPNEL_MEMBERS
  // clang-format on
}

// ---- Bytes ----

class Bytes {
 public:
  std::string text;

  template <class Number>
  requires std::is_arithmetic_v<Number> || std::is_enum_v<Number>
  void put(const Number& number) {
    char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    text.append(bytes, sizeof number);
  }
  void put(const std::string& words) {
    put(words.size());
    text += words;
  }
  template <class Value>
  void put(const std::optional<Value>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class Value>
  void put(const std::vector<Value>& list) {
    put(list.size());
    for (const Value& one : list) put(one);
  }
  template <class A, class B>
  void put(const std::pair<A, B>& both) {
    put(both.first);
    put(both.second);
  }
  void put(const std::shared_ptr<const TriangleMesh>& mesh) { put(reinterpret_cast<std::uintptr_t>(mesh.get())); }
  void put(const std::shared_ptr<const EffortLog>& log) {
    put(log != nullptr);
    if (log) put(*log);
  }
  void put(const std::shared_ptr<const ControllerSource>&) {}  // identified by the other members
  void put(const std::shared_ptr<const RobotSetup>& undeformed) {
    put(undeformed != nullptr);
    if (undeformed) put(*undeformed);
  }
  void put(const std::shared_ptr<const SourceTexts>&) {}  // origin of a problem, not part of its value
  void put(const BodyName& body) { put(body.name), put(body.target), put(body.obstacle); }
  void put(const Vector3d& v) {
    for (int i = 0; i < 3; ++i) put(v[i]);
  }
  void put(const Rotationd& R) {
    for (int i = 0; i < 3; ++i) put(R.column(i));
  }
  void put(const EndEffectorSetup& e) {
    static_assert(member_count<EndEffectorSetup>() == 4, "a member is missing below");
    put(static_cast<const FrameDescription&>(e));
    put(e.approach_axis), put(e.envelope), put(e.rating);
  }
  void put(const ThrusterSetup& t) {
    static_assert(member_count<ThrusterSetup>() == 3, "a member is missing below");
    put(static_cast<const Thruster&>(t));
    put(t.name), put(t.plume);
  }
  void put(const ImpedanceSetup& impedance) {
    static_assert(member_count<ImpedanceSetup>() == 3, "a member is missing below");
    put(static_cast<const ImpedanceGains&>(impedance));
    put(impedance.end_effectors), put(impedance.match);
  }
  template <class Structure>
  requires std::is_aggregate_v<Structure>
  void put(const Structure& structure) {
    with_members(structure, [this](const auto&... members) { (this->put(members), ...); });
  }
};

}  // namespace

std::string problem_bytes(const CaptureProblem& problem) {
  CaptureProblem nameless = problem;
  nameless.sha256.clear();
  Bytes bytes;
  bytes.put(nameless);
  return std::move(bytes.text);
}

}  // namespace grapnel
