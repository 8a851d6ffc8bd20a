#include "grapnel/model/coupling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

namespace grapnel {
namespace {

// Indices of bodies by the names of their joints; the first of equal names.
using JointNames = std::map<std::string_view, std::size_t>;

JointNames joint_names(std::span<const BodyDescription> bodies) {
  JointNames names;
  for (std::size_t i = 0; i < bodies.size(); ++i) names.emplace(bodies[i].joint.name, i);
  return names;
}

// Why a joint cannot be coupled; empty: it can.
std::string_view obstacle(const JointDescription& joint) {
  if (!has_one_axis(joint.type)) return "has no axis";
  if (joint.spring) return "has a spring";
  if (joint.elasticity) return "has a flexible gear";
  if (joint.modal) return "moves by mode shapes";
  return {};
}

class FaultFinder {
 public:
  explicit FaultFinder(std::span<const BodyDescription> bodies) : bodies_(bodies), names_(joint_names(bodies)) {}

  std::vector<CouplingFault> find() && {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!bodies_[i].joint.mimic.empty()) check(i);
    }
    if (faults_.empty()) check_cycles();
    return std::move(faults_);
  }

 private:
  void check(std::size_t body) {
    const JointDescription& joint = bodies_[body].joint;
    if (const std::string_view why = obstacle(joint); !why.empty())
      faults_.push_back({body, -1, {}, fmt::format("mimic: this joint cannot follow another: it {}", why)});
    for (std::size_t k = 0; k < joint.mimic.size(); ++k) check_term(body, static_cast<int>(k));
  }

  void check_term(std::size_t body, int k) {
    const std::vector<CouplingTerm>& terms = bodies_[body].joint.mimic;
    const CouplingTerm& term = terms[k];
    const auto add = [&](const char* key, std::string text, bool unknown = false) {
      faults_.push_back({body, k, key, std::move(text), unknown});
    };
    if (!std::isfinite(term.ratio) || term.ratio == 0)
      add("ratio", fmt::format("mimic: ratio is {}, must be a finite number other than zero", term.ratio));
    if (!std::isfinite(term.offset)) add("offset", fmt::format("mimic: offset is {}, must be finite", term.offset));
    if (term.joint.empty()) return add("joint", "mimic names no joint");
    const auto other = names_.find(term.joint);
    if (other == names_.end()) return add("joint", fmt::format("mimic names the unknown joint '{}'", term.joint), true);
    if (other->second == body) return add("joint", "mimic: a joint cannot follow itself");
    if (const std::string_view why = obstacle(bodies_[other->second].joint); !why.empty())
      add("joint", fmt::format("mimic: joint '{}' cannot be followed: it {}", term.joint, why));
    const auto same = [&](const CouplingTerm& t) { return t.joint == term.joint; };
    if (std::any_of(terms.begin(), terms.begin() + k, same))
      add("joint", fmt::format("mimic names joint '{}' twice; add the ratios", term.joint));
  }

  // A joint that follows itself through others: each cycle is reported at its first joint.
  void check_cycles() {
    enum class Visit { none, open, done };
    std::vector<Visit> visits(bodies_.size(), Visit::none);
    std::vector<std::size_t> path;
    const auto visit = [&](const auto& self, std::size_t body) -> void {
      visits[body] = Visit::open;
      path.push_back(body);
      for (const CouplingTerm& term : bodies_[body].joint.mimic) {
        const std::size_t next = names_.find(term.joint)->second;
        if (visits[next] == Visit::none) self(self, next);
        if (visits[next] == Visit::open) report_cycle(path, next);
      }
      path.pop_back();
      visits[body] = Visit::done;
    };
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (visits[i] == Visit::none) visit(visit, i);
    }
  }

  void report_cycle(const std::vector<std::size_t>& path, std::size_t first) {
    std::string text;
    for (auto at = std::find(path.begin(), path.end(), first); at != path.end(); ++at)
      text += fmt::format("'{}' -> ", bodies_[*at].joint.name);
    faults_.push_back({first, -1, {}, fmt::format("mimic forms a cycle: {}'{}'", text, bodies_[first].joint.name)});
  }

  std::span<const BodyDescription> bodies_;
  JointNames names_;
  std::vector<CouplingFault> faults_;
};

// Inertia of a body alone at its joint, with its rotor [kg m^2 or kg].
double inertia_at_joint(const Body& body) {
  const BodyDescription& d = body.description;
  const double rotor = d.joint.reflected_inertia();
  if (slides_along_axis(d.joint.type)) return d.mass + rotor;
  const Vector3d& axis = d.joint.axis;  // through the body's origin
  const Vector3d lever = cross(axis, d.com);
  return dot(axis, d.inertia * axis) + d.mass * dot(lever, lever) + rotor;
}

}  // namespace

std::vector<CouplingFault> coupling_faults(std::span<const BodyDescription> bodies) {
  const auto is_free = [](const BodyDescription& body) { return body.joint.mimic.empty(); };
  if (std::all_of(bodies.begin(), bodies.end(), is_free)) return {};
  return FaultFinder(bodies).find();
}

std::vector<JointCoupling> couplings_of(std::span<const BodyDescription> bodies) {
  std::vector<JointCoupling> couplings;
  JointNames names;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].joint.mimic.empty()) continue;
    if (names.empty()) names = joint_names(bodies);
    JointCoupling coupling;
    coupling.joints.push_back({static_cast<int>(i), 1});
    for (const CouplingTerm& term : bodies[i].joint.mimic) {
      coupling.joints.push_back({static_cast<int>(names.find(term.joint)->second), -term.ratio});
      coupling.offset += term.offset;
    }
    couplings.push_back(std::move(coupling));
  }
  return couplings;
}

bool is_coupled(const Model& model, int body) {
  return std::ranges::any_of(model.couplings(), [&](const JointCoupling& coupling) {
    return std::ranges::any_of(coupling.joints, [&](const JointCoupling::Joint& joint) { return joint.body == body; });
  });
}

double coupling_defect(const Model& model, const JointCoupling& coupling, std::span<const double> q) {
  double defect = -coupling.offset;
  for (const auto& [body, factor] : coupling.joints) defect += factor * q[model.bodies()[body].q];
  return defect;
}

double coupling_rate(const Model& model, const JointCoupling& coupling, std::span<const double> v) {
  double rate = 0;
  for (const auto& [body, factor] : coupling.joints) rate += factor * v[model.bodies()[body].v];
  return rate;
}

// Coordinates and rates => the same with dependent joints on their couplings. A coupling on another dependent joint
// waits for that one: as many passes as couplings settle every chain.
void follow_couplings(const Model& model, std::span<double> q, std::span<double> v) {
  for (std::size_t pass = 0; pass < model.couplings().size(); ++pass) {
    for (const JointCoupling& coupling : model.couplings()) {
      const Body& body = model.bodies()[dependent_body(coupling)];
      q[body.q] -= coupling_defect(model, coupling, q);
      v[body.v] -= coupling_rate(model, coupling, v);
    }
  }
}

double coupling_scale(const Model& model, const JointCoupling& coupling) {
  double mobility = 0;
  for (const auto& [body, factor] : coupling.joints) {
    const double inertia = inertia_at_joint(model.bodies()[body]);
    mobility += factor * factor / (inertia > 0 ? inertia : 1);
  }
  return 1 / std::sqrt(mobility);
}

}  // namespace grapnel
