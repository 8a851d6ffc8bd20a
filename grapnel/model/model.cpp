#include "grapnel/model/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "grapnel/model/coupling.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {
namespace {

std::string join(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

bool finite(const Vector3d& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }
bool finite(const Symmetric3d& m) {
  return std::isfinite(m.xx + m.yy + m.zz) && std::isfinite(m.xy) && std::isfinite(m.xz) && std::isfinite(m.yz);
}
bool finite(const Posed& X) {
  for (const auto& row : X.R.m) {
    for (double x : row) {
      if (!std::isfinite(x)) return false;
    }
  }
  return finite(X.p);
}

// Largest entry of R^T R - 1, or infinity for a reflection.
double rotation_defect(const Rotationd& R) {
  const Rotationd G = transpose(R) * R;
  double worst = dot(cross(R.column(0), R.column(1)), R.column(2)) > 0 ? 0 : INFINITY;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) worst = std::max(worst, std::abs(G(i, j) - (i == j ? 1 : 0)));
  }
  return worst;
}

// Error of a pose; empty if valid.
std::string placement_fault(const Posed& X) {
  if (!finite(X)) return "placement is not finite";
  const double defect = rotation_defect(X.R);
  if (defect > 1e-9) return fmt::format("orientation is not a rotation (R^T R differs from 1 by {:.3g})", defect);
  return {};
}

// Eigenvalues of a symmetric 3 x 3 matrix in ascending order, by cyclic Jacobi rotations.
std::array<double, 3> eigenvalues(Symmetric3d A) {
  double a[3][3] = {{A.xx, A.xy, A.xz}, {A.xy, A.yy, A.yz}, {A.xz, A.yz, A.zz}};
  for (int sweep = 0; sweep < 30; ++sweep) {
    const double off = a[0][1] * a[0][1] + a[0][2] * a[0][2] + a[1][2] * a[1][2];
    if (off == 0) break;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (theta < 0 ? -1.0 : 1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (auto& row : a) {
          const double rp = row[p], rq = row[q];
          row[p] = c * rp - s * rq, row[q] = s * rp + c * rq;
        }
        for (int k = 0; k < 3; ++k) {
          const double pk = a[p][k], qk = a[q][k];
          a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
        }
      }
    }
  }
  std::array<double, 3> values{a[0][0], a[1][1], a[2][2]};
  std::sort(values.begin(), values.end());
  return values;
}

// Body => messages about its joint, appended to `faults`: axis, limits, friction, rotor, spring, stop and motor.
void check_joint(const BodyDescription& body, std::vector<std::string>& faults) {
  const JointDescription& j = body.joint;
  const auto fault = [&](const std::string& text) {
    faults.push_back(fmt::format("joint '{}' of body '{}': {}", j.name, body.name, text));
  };
  if (has_one_axis(j.type)) {
    const double length = norm(j.axis);
    if (!(std::abs(length - 1) < 1e-9)) fault(fmt::format("axis has length {}, must be a unit vector", length));
  }
  if (j.limits.lower > j.limits.upper)
    fault(fmt::format("lower limit {} is above upper limit {}", j.limits.lower, j.limits.upper));
  if (!(j.limits.rate > 0)) fault(fmt::format("rate limit {} must be positive", j.limits.rate));
  if (!(j.limits.effort > 0)) fault(fmt::format("effort limit {} must be positive", j.limits.effort));
  if (!(j.friction.viscous >= 0) || !(j.friction.coulomb >= 0)) fault("friction must not be negative");
  if (!(j.friction.transition_rate > 0)) fault("friction transition rate must be positive");
  if (j.friction.model == JointFriction::Model::sticking && !(j.friction.breakaway() >= j.friction.coulomb))
    fault("static friction must not be less than Coulomb's");
  if (!(j.rotor_inertia >= 0) || !std::isfinite(j.gear_ratio))
    fault("rotor inertia must not be negative, gear ratio finite");
  if (j.rotor_axis && !(std::abs(norm(*j.rotor_axis) - 1) < 1e-9)) fault("the rotor's axis must be a unit vector");
  if (const auto& s = j.spring; s && (!has_one_axis(j.type) || !(s->stiffness > 0) || !std::isfinite(s->stiffness) ||
                                      !(s->damping >= 0) || !std::isfinite(s->rest) || !(s->backlash >= 0)))
    fault("a spring needs a joint of one axis, a positive stiffness and damping that is not negative");
  if (const auto& stop = j.limits.stop;
      stop && (!(stop->restitution >= 0 && stop->restitution <= 1) || !(stop->rest_rate >= 0)))
    fault("a stop's restitution must be from 0 to 1, its rest rate not negative");
  if (const auto& m = j.motor; m && (!(m->no_load_rate > 0) || !(m->torque_constant >= 0) || !(m->resistance >= 0)))
    fault("a motor's no-load rate must be positive, torque constant and resistance not negative");
}

// Body => messages about its placement, mass, inertia and joint, appended to `faults`; parts of a body may have any
// finite mass.
void check_body(const BodyDescription& body, std::vector<std::string>& faults) {
  const auto fault = [&](const std::string& text) { faults.push_back(fmt::format("body '{}': {}", body.name, text)); };
  if (const std::string text = placement_fault(body.X_PF); !text.empty()) fault("joint " + text);
  if (!finite(body.com)) fault("centre of mass is not finite");
  if (!body.part_of.empty()) {
    if (!std::isfinite(body.mass) || !finite(body.inertia) || body.parent.empty())
      fault("a part of a body needs a parent, and a mass and an inertia that are finite");
  } else {
    if (!(body.mass > 0) || !std::isfinite(body.mass)) fault(fmt::format("mass {} must be positive", body.mass));
    const std::string inertia = inertia_fault(body.inertia);
    if (!inertia.empty()) fault(inertia);
  }
  check_joint(body, faults);
}

// Indices of bodies by their names.
using BodyNames = std::unordered_map<std::string_view, std::size_t>;

// Checks each body and frame, and that names are unique and exist.
BodyNames check_names(const std::vector<BodyDescription>& bodies, const std::vector<FrameDescription>& frames,
                      std::vector<std::string>& faults) {
  BodyNames given;
  given.reserve(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyDescription& b = bodies[i];
    check_body(b, faults);
    if (!given.emplace(b.name, i).second) faults.push_back(fmt::format("body '{}' occurs twice", b.name));
  }
  if (bodies.empty()) faults.push_back("a model needs at least one body");
  for (const BodyDescription& b : bodies) {
    const bool root = b.parent.empty();
    if (!root && !given.contains(b.parent))
      faults.push_back(fmt::format("body '{}': unknown parent '{}'", b.name, b.parent));
    if (root && b.joint.type != JointType::free && b.joint.type != JointType::fixed) {
      faults.push_back(fmt::format("body '{}': a root must be free or fixed to the world", b.name));
    }
    if (!root && b.joint.type == JointType::free) {
      faults.push_back(fmt::format("body '{}': only a root can be free", b.name));
    }
  }
  std::unordered_set<std::string_view> frame_names;
  for (const FrameDescription& f : frames) {
    if (!given.contains(f.body)) faults.push_back(fmt::format("frame '{}': unknown body '{}'", f.name, f.body));
    if (const std::string text = placement_fault(f.X_BE); !text.empty()) {
      faults.push_back(fmt::format("frame '{}': {}", f.name, text));
    }
    if (!frame_names.insert(f.name).second) faults.push_back(fmt::format("frame '{}' occurs twice", f.name));
  }
  return given;
}

// Bodies sorted parents first.
struct BodyOrder {
  std::vector<int> place;          // of a given body in the sorted list
  std::vector<std::size_t> given;  // the reverse
  std::vector<int> parent;         // of a sorted body, in the sorted list; -1: the world
};

// Topological order; otherwise the given order. Each pass places the bodies whose parent is placed; the remaining
// bodies form cycles.
BodyOrder parents_first(const std::vector<BodyDescription>& bodies, const BodyNames& given,
                        std::vector<std::string>& faults) {
  constexpr int kNotPlaced = -1;
  BodyOrder order{std::vector<int>(bodies.size(), kNotPlaced), {}, {}};
  for (bool progress = true; progress;) {
    progress = false;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (order.place[i] != kNotPlaced) continue;
      const bool is_root = bodies[i].parent.empty();
      const int carrier = is_root ? -1 : order.place[given.find(bodies[i].parent)->second];
      if (!is_root && carrier == kNotPlaced) continue;
      order.place[i] = static_cast<int>(order.given.size());
      order.given.push_back(i), order.parent.push_back(carrier);
      progress = true;
    }
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (order.place[i] == kNotPlaced)
      faults.push_back(fmt::format("body '{}': its parents form a cycle", bodies[i].name));
  }
  return order;
}

}  // namespace

// Inertia about the centre of mass => reason why no body has it; empty if it is positive definite and its principal
// moments satisfy the triangle inequality to 1e-9.
std::string inertia_fault(const Symmetric3d& inertia) {
  if (!finite(inertia)) return "inertia is not finite";
  const auto lambda = eigenvalues(inertia);
  if (!(lambda[0] > 0)) {
    return fmt::format("inertia is not positive definite (principal moments {:.6g}, {:.6g}, {:.6g})", lambda[0],
                       lambda[1], lambda[2]);
  }
  if (lambda[2] > (lambda[0] + lambda[1]) * (1 + 1e-9)) {
    return fmt::format(
        "inertia breaks the triangle inequality: principal moment {:.6g} is larger than the sum of {:.6g} and {:.6g}, "
        "which no "
        "body has",
        lambda[2], lambda[0], lambda[1]);
  }
  return {};
}

ModelError::ModelError(std::vector<std::string> faults)
    : std::invalid_argument(join(faults)), faults_(std::move(faults)) {}

Model::Model() : tree_(std::make_shared<const Tree<double>>()) {}

double Model::mass() const {
  double total = 0;
  for (const Body& b : bodies_) total += b.description.mass;
  return total;
}

namespace {
template <class Items, class Name>
int find_by_name(const Items& items, std::string_view name, std::string_view kind, Name name_of) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (name_of(items[i]) == name) return static_cast<int>(i);
  }
  std::string known;
  for (const auto& item : items) known += (known.empty() ? "'" : ", '") + std::string(name_of(item)) + "'";
  throw std::out_of_range(
      fmt::format("no {} '{}' in the model; there are {}", kind, name, known.empty() ? "none" : known));
}
}  // namespace

int Model::body_index(std::string_view name) const {
  return find_by_name(bodies_, name, "body", [](const Body& b) -> const std::string& { return b.description.name; });
}
int Model::frame_index(std::string_view name) const {
  return find_by_name(frames_, name, "frame", [](const Frame& f) -> const std::string& { return f.name; });
}
bool Model::has_free_root(int body) const {
  return bodies_[bodies_.at(body).root].description.joint.type == JointType::free;
}

ModelBuilder::ModelBuilder(const Model& model) {
  for (const Body& b : model.bodies()) bodies_.push_back(b.description);
  for (const Frame& f : model.frames()) frames_.push_back({f.name, model.bodies()[f.body].description.name, f.X_BE});
}

ModelBuilder& ModelBuilder::add(BodyDescription body) {
  constexpr std::size_t kUsual = 16;  // number of bodies; a description has about a thousand bytes
  if (bodies_.empty()) bodies_.reserve(kUsual);
  bodies_.push_back(std::move(body));
  return *this;
}
ModelBuilder& ModelBuilder::add(FrameDescription frame) {
  frames_.push_back(std::move(frame));
  return *this;
}
ModelBuilder& ModelBuilder::attach(std::string_view body, std::string_view parent, const Posed& X_PF,
                                   JointDescription joint) {
  const auto it = std::find_if(bodies_.begin(), bodies_.end(), [&](const auto& b) { return b.name == body; });
  if (it == bodies_.end()) throw std::out_of_range(fmt::format("no body '{}' to attach", body));
  it->parent = parent;
  it->X_PF = X_PF;
  it->joint = std::move(joint);
  return *this;
}

// Builder that is kept => model, from a copy.
Model ModelBuilder::build() const& { return ModelBuilder(*this).build(); }

// Bodies and frames => model: parents before children, coordinates and velocities numbered in that order, axes
// normalized, links by make_tree(). Throws ModelError with all errors of the first stage that fails.
Model ModelBuilder::build() && {
  std::vector<std::string> faults;
  const BodyNames given = check_names(bodies_, frames_, faults);
  if (!faults.empty()) throw ModelError(std::move(faults));
  const BodyOrder order = parents_first(bodies_, given, faults);
  if (!faults.empty()) throw ModelError(std::move(faults));

  Model model;
  model.frames_.reserve(frames_.size());
  for (FrameDescription& f : frames_) {
    const int body = order.place[given.find(f.body)->second];
    model.frames_.push_back({std::move(f.name), body, f.X_BE});
  }
  std::vector<BodyDescription> sorted;  // `given` is invalid from here on
  if (std::is_sorted(order.given.begin(), order.given.end())) {
    sorted = std::move(bodies_);
  } else {
    sorted.reserve(bodies_.size());
    for (const std::size_t i : order.given) sorted.push_back(std::move(bodies_[i]));
  }
  for (BodyDescription& body : sorted) {
    // Normalized, since kernels and Jacobians must use the same direction.
    Vector3d& axis = body.joint.axis;
    if (has_one_axis(body.joint.type)) axis *= 1 / norm(axis);
    if (auto& rotor_axis = body.joint.rotor_axis) *rotor_axis *= 1 / norm(*rotor_axis);
  }
  faults = chain_faults(sorted, order.parent);
  for (const CouplingFault& fault : coupling_faults(sorted))
    faults.push_back(fmt::format("joint '{}': {}", sorted[fault.body].joint.name, fault.text));
  if (!faults.empty()) throw ModelError(std::move(faults));
  model.number(std::move(sorted), order.parent);
  return model;
}

// Sorted bodies and their parents => the model's bodies, its lists of joints, and its tree.
void Model::number(std::vector<BodyDescription> sorted, const std::vector<int>& parent) {
  std::vector<int> q, v;
  int next_q = 0, next_v = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const BodyDescription& b = sorted[i];
    const JointType type = b.joint.type;
    q.push_back(next_q), v.push_back(next_v);
    if (const int at = traits_of(type).quaternion; at >= 0) quaternions_.push_back(next_q + at);
    if (has_one_axis(type)) joints_.push_back(static_cast<int>(i));
    if (const Vector3d h = b.joint.rotor_momentum(); has_one_axis(type) && dot(h, h) > 0)
      rotors_.push_back(static_cast<int>(i));
    if (b.joint.spring) springs_.push_back(static_cast<int>(i));
    next_q += coordinate_count(type), next_v += velocity_count(type);
  }
  couplings_ = couplings_of(sorted);
  std::vector<BodyPlacement> placements;
  tree_ = std::make_shared<const Tree<double>>(make_tree(sorted, parent, q, v, placements));
  coordinates_ = tree_->coordinates, velocities_ = tree_->velocities;
  bodies_.reserve(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const int root = parent[i] < 0 ? static_cast<int>(i) : bodies_[parent[i]].root;
    bodies_.push_back({std::move(sorted[i]), parent[i], q[i], v[i], root, placements[i]});
  }
}

}  // namespace grapnel
