#include "grapnel/impact/compliant_system.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/dynamics/workspace.hpp"

namespace grapnel {

CompliantPacks::~CompliantPacks() = default;

double largest_deformation(const CompliantContact& contact, double mass, double speed) {
  // k d^(n+1) / (n + 1) = m v^2 / 2
  const ContactForceModel model = contact.model;
  const double n = model == ContactForceModel::kelvin_voigt ? 1
                   : model == ContactForceModel::hertz      ? 1.5
                                                            : contact.exponent;
  return std::pow((n + 1) / 2 * mass * speed * speed / contact.stiffness, 1 / (n + 1));
}

namespace {

// The first contact point: near deformations, displacements have the smallest cancellation errors.
Vector3d reference_point(std::span<const CompliantContact> contacts, std::span<const CompliantGrasp> grasps) {
  return !contacts.empty() ? contacts[0].p_WC : !grasps.empty() ? grasps[0].grasp.p_WC : Vector3d::zero();
}

std::vector<std::uint8_t> marked(int size, std::span<const int> indices) {
  std::vector<std::uint8_t> marks(size);
  for (int i : indices) marks.at(i) = 1;
  return marks;
}

int free_root_at(const Model& model, int velocity) {
  const auto is_it = [&](const Body& b) { return b.v == velocity && b.description.joint.type == JointType::free; };
  const std::vector<Body>& bodies = model.bodies();
  return static_cast<int>(std::find_if(bodies.begin(), bodies.end(), is_it) - bodies.begin());
}

using MakePacks = CompliantPacks* (*)(const CompliantTables&, const TreeLink<double>*, int);

// Instruction set => function that makes the batches of evaluations; one lane for unknown sets and other processors.
MakePacks packs_of(lanes::InstructionSet set) {
  return lanes::of_set(set,
                       []<class Set>(std::type_identity<Set>) -> MakePacks { return make_compliant_packs_of<Set>; });
}

}  // namespace

// Model, start, contacts, grasps, held velocities, drive => tables of bodies, trees, interfaces and springs, and the
// layout of the integrated quantities: coordinates, rates, impulses, losses, held impulses, work (docs/theory, section
// 12). With an instruction set, and without modal chains, points are also evaluated in batches.
CompliantSystem::CompliantSystem(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                                 std::span<const CompliantGrasp> grasps, std::span<const int> held, ImpactDrive* drive,
                                 std::optional<lanes::InstructionSet> set, std::span<const LoopClosure> loops)
    : phase(contacts.size(), ContactPhase::apart),
      model_(model),
      drive_(drive),
      start_(state),
      now_(state),
      held_(held.begin(), held.end()),
      quaternions_(model.quaternions().begin(), model.quaternions().end()),
      prescribed_(marked(model.velocities(), held)),
      effort_(model.velocities()),
      drive_state_(state),
      point_state_(state) {
  const Vector3d origin_W = reference_point(contacts, grasps);
  describe_bodies(origin_W);
  describe_trees();
  describe_interfaces(contacts, grasps, origin_W);
  describe_loops(loops);
  describe_springs();
  CompliantTables& t = tables_;
  t.coordinates = model.coordinates(), t.velocities = model.velocities();
  t.q = start_.q.data(), t.v = start_.v.data();
  t.quaternions = quaternions_.data(), t.quaternion_count = static_cast<int>(quaternions_.size());
  t.bodies = bodies_.data(), t.body_count = static_cast<int>(bodies_.size());
  t.trees = trees_.data(), t.tree_count = static_cast<int>(trees_.size());
  t.interfaces = interfaces_.data();
  t.contact_count = static_cast<int>(contacts.size()), t.grasp_count = static_cast<int>(grasps.size());
  t.phase = phase.data();
  t.springs = springs_.data(), t.spring_count = static_cast<int>(springs_.size());
  t.rates = rates_.data(), t.rate_count = static_cast<int>(rates_.size());
  t.held = held_.data(), t.held_count = static_cast<int>(held_.size());
  t.prescribed = prescribed_.data();
  t.driven = drive != nullptr;
  t.channel_point = origin_W;
  t.channels = channels_.data(), t.channel_count = static_cast<int>(channels_.size());
  lay_out();
  kernel_.emplace(tables_, model.tree());
  if (!set || !model.tree().chains.empty() || !loops_.empty()) return;
  const std::vector<TreeLink<double>>& links = model.tree().links;
  packs_.reset(packs_of(*set)(tables_, links.data(), static_cast<int>(links.size())));
}

void CompliantSystem::lay_out() {
  CompliantTables& t = tables_;
  t.rate_at = t.coordinates;
  t.impulse_at = t.rate_at + t.rate_count;
  t.channel_at = t.impulse_at + 6 * t.interface_count();
  stick_at_ = t.channel_at + 6 * t.channel_count;
  t.loss_at = stick_at_ + (shapes_act_ ? shapes_->stick_numbers() : 0);
  t.held_at = t.loss_at + t.interface_count();
  t.work_at = t.held_at + t.held_count;
  shape_at_ = t.spring_at() + (springs_.empty() ? 0 : 1);
  t.size = shape_at_ + (shapes_act_ ? shapes_->integral_numbers() : 0);
}

void CompliantSystem::describe_bodies(const Vector3d& origin_W) {
  const Kinematics k = forward_kinematics(model_, start_);
  std::vector<double> tree_mass(model_.bodies().size(), 0.0);
  for (const Body& b : model_.bodies()) tree_mass[b.root] += b.description.mass;
  for (std::size_t i = 0; i < model_.bodies().size(); ++i) {
    const Body& b = model_.bodies()[i];
    const Posed& X_WB = k.X_WB[i];
    bodies_.push_back({b.description.joint.type, b.parent, b.root, b.q, X_WB.R * b.description.joint.axis,
                       X_WB.p - origin_W, X_WB * b.description.com - origin_W, X_WB.R,
                       b.description.mass / tree_mass[b.root]});
  }
}

// Free trees move by their momentum unless their root is held; other rates are integrated.
void CompliantSystem::describe_trees() {
  Workspace workspace(model_);
  std::vector<RootMomentum<double>> momenta(free_root_count(model_.tree()));
  root_momenta<double>(model_.tree(), start_.q, start_.v, workspace.kernel, momenta);
  std::vector<std::uint8_t> recovered(model_.velocities());
  bool all_by_momentum = true;
  Vector3d total = Vector3d::zero();
  for (const TreeLink<double>& link : model_.tree().links) {
    all_by_momentum = all_by_momentum && link.joint != JointType::fixed;
    if (link.joint != JointType::free) continue;
    const RootMomentum<double>& m = momenta[trees_.size()];
    const bool by_momentum = prescribed_[link.v] == 0;
    trees_.push_back({free_root_at(model_, link.v), link.q, link.v, by_momentum, m.h, m.p_WCom, m.mass});
    total += m.h.linear;
    if (by_momentum) std::fill_n(recovered.begin() + link.v, 6, std::uint8_t{1});
    all_by_momentum = all_by_momentum && by_momentum;
  }
  tables_.drift = all_by_momentum ? (1 / model_.mass()) * total : Vector3d::zero();
  for (int v = 0; v < model_.velocities(); ++v) {
    if (prescribed_[v] == 0 && recovered[v] == 0) rates_.push_back(v);
  }
}

InterfaceSide CompliantSystem::side(int body) const {
  const int root = model_.bodies()[body].root;
  const auto tree = std::find_if(trees_.begin(), trees_.end(), [&](const StartTree& t) { return t.body == root; });
  return {body, model_.bodies()[body].placement.link,
          tree == trees_.end() ? -1 : static_cast<int>(tree - trees_.begin())};
}

// Contacts and grasps => interface tables (sides, points relative to origin_W, laws (12.4) to (12.10)), one pair of
// wrenches each, and the roots that take part, including those of held velocities.
void CompliantSystem::describe_interfaces(std::span<const CompliantContact> contacts,
                                          std::span<const CompliantGrasp> grasps, const Vector3d& origin_W) {
  const auto add = [&](int robot, int target, const Vector3d& point) -> InterfaceTable& {
    for (const int body : {robot, target}) {
      taking_part_.push_back(model_.bodies()[body].root);
      wrenches_.push_back({body, {}, {}});
    }
    InterfaceTable& at = interfaces_.emplace_back();
    at.robot = side(robot), at.target = side(target);
    at.point = point, at.arm = point - origin_W;
    return at;
  };
  for (const CompliantContact& c : contacts) {
    InterfaceTable& at = add(c.robot_body, c.target_body, c.p_WC);
    at.normal = c.n_W, at.model = c.model;
    at.stiffness = c.stiffness, at.damping = c.damping, at.exponent = c.exponent;
    at.friction = c.friction, at.slip_speed = c.slip_speed;
  }
  for (const CompliantGrasp& g : grasps) {
    InterfaceTable& at = add(g.grasp.robot_body, g.grasp.target_body, g.grasp.p_WC);
    at.stiffness = g.linear_stiffness, at.damping = g.linear_damping;
    at.turns = g.grasp.model == GraspModel::rigid   ? GraspTurns::none
               : g.grasp.model == GraspModel::hinge ? GraspTurns::about_hinge
                                                    : GraspTurns::free;
    at.hinge = g.grasp.hinge_W;
    at.angular_stiffness = g.angular_stiffness, at.angular_damping = g.angular_damping;
  }
  for (const Body& body : model_.bodies()) {
    if (velocity_count(body.description.joint.type) > 0 && prescribed_[body.v] != 0) taking_part_.push_back(body.root);
  }
}

// Closures => their solver, and the channels of their impulses.
void CompliantSystem::describe_loops(std::span<const LoopClosure> loops) {
  for (std::size_t body = 0; body < model_.bodies().size(); ++body)
    tree_of_.push_back(side(static_cast<int>(body)).tree);
  if (loops.empty()) return;
  loops_.assign(loops.begin(), loops.end());
  loop_solver_.emplace(model_, loops_);
  loop_workspace_.emplace(model_);
  loop_vdot_.resize(model_.velocities()), loop_force_.resize(model_.velocities());
  for (const LoopClosure& loop : loops_) {
    const int a = tree_of_[loop.body_a], b = tree_of_[loop.body_b];
    constexpr int kInside = ImpulseChannel::kInside;
    channels_.push_back(a == b ? ImpulseChannel{kInside, kInside} : ImpulseChannel{a, b});
    for (const int body : {loop.body_a, loop.body_b}) taking_part_.push_back(model_.bodies()[body].root);
  }
}

std::vector<Grasp> CompliantSystem::closed_grasps(const Kinematics& kinematics) const {
  std::vector<Grasp> closed;
  for (const LoopClosure& loop : loops_) {
    const Posed X_WC = kinematics.X_WB[loop.body_a] * loop.X_AC;
    closed.push_back({loop.body_a, loop.body_b, loop.model, X_WC.p, X_WC.R * loop.hinge_C});
  }
  return closed;
}

std::string CompliantSystem::contradiction() const {
  if (!loop_solver_ || !(loop_solver_->contradiction() > loop_limits::kContradiction)) return {};
  return loop_solver_->contradicting_row();
}

// The kernel's accelerations => those with the closures.
void CompliantSystem::close_accelerations() {
  loop_solver_->accelerations(kernel_->input(), 0, *loop_workspace_, loop_vdot_, loop_force_);
  kernel_->replace_accelerations(loop_vdot_, loop_force_);
}

// Multipliers of the last accelerations => rates of the closures' impulses about their common point, as (12.1).
void CompliantSystem::add_loop_rates(double* dydt) {
  std::copy(kernel_->q().begin(), kernel_->q().end(), point_state_.q.begin());
  std::copy(kernel_->v().begin(), kernel_->v().end(), point_state_.v.begin());
  Kinematics& k = loop_workspace_->kinematics;
  forward_kinematics(model_, point_state_, k);
  std::size_t row = 0;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    const LoopClosure& loop = loops_[i];
    const auto count = static_cast<std::size_t>(row_count(loop.model));
    const Posed X_WC = k.X_WB[loop.body_a] * loop.X_AC;
    const Wrenchd on_a = X_WC.R * closure_wrench(loop, loop_solver_->multipliers().subspan(row, count));
    const Wrenchd F = shift(on_a, tables_.channel_point - X_WC.p);
    double* const at = dydt + loop_offset(static_cast<int>(i));
    for (int n = 0; n < 3; ++n) at[n] = F.angular[n], at[3 + n] = F.linear[n];
    row += count;
  }
}

void CompliantSystem::describe_springs() {
  for (const int body : model_.springs()) {
    const Body& b = model_.bodies()[body];
    const JointSpring& s = *b.description.joint.spring;
    springs_.push_back({b.q, b.v, s.stiffness, s.damping, s.rest, s.backlash, takes_part(body)});
  }
}

// --- A point ---

void CompliantSystem::place(double t, std::span<const double> y) {
  kernel_->load(t, y.data());
  std::copy(kernel_->q().begin(), kernel_->q().end(), now_.q.begin());
  std::copy(kernel_->v().begin(), kernel_->v().end(), now_.v.begin());
}

void CompliantSystem::load(double t, std::span<const double> y) {
  place(t, y);
  if (shapes_act_) load_shapes(y.data(), now_);
}

double CompliantSystem::kinetic_energy_now() const {
  return kinetic_energy(model_, forward_kinematics(model_, now_), now_);
}

bool CompliantSystem::takes_part(int body) const {
  return std::find(taking_part_.begin(), taking_part_.end(), model_.bodies()[body].root) != taking_part_.end();
}

double CompliantSystem::spring_energy_now() const {
  double energy = 0;
  for (const int body : model_.springs()) {
    if (takes_part(body)) energy += spring_energy(model_, now_, body);
  }
  return energy;
}

double CompliantSystem::kinetic_energy_taking_part_now() const {
  return taking_part_.empty() ? 0 : kinetic_energy(model_, forward_kinematics(model_, now_), now_, taking_part_);
}

std::span<const ExternalWrench> CompliantSystem::wrenches(std::span<const InterfaceLoad> loads) {
  for (std::size_t i = 0; i < loads.size(); ++i) {
    wrenches_[2 * i].p_WP = wrenches_[2 * i + 1].p_WP = loads[i].point;
    wrenches_[2 * i].F_W = loads[i].F;
    wrenches_[2 * i + 1].F_W = -loads[i].F;
  }
  if (shapes_act_) {
    wrenches_.resize(2 * interfaces_.size());
    wrenches_.insert(wrenches_.end(), shapes_->wrenches().begin(), shapes_->wrenches().end());
  }
  return wrenches_;
}

// --- Many points ---

void CompliantSystem::drive_efforts(double t, const double* q, const double* v, const InterfaceLoad* loads,
                                    double* effort) {
  std::copy_n(q, drive_state_.q.size(), drive_state_.q.begin());
  std::copy_n(v, drive_state_.v.size(), drive_state_.v.begin());
  std::fill(effort_.begin(), effort_.end(), 0.0);
  drive_->efforts(t, drive_state_, wrenches({loads, static_cast<std::size_t>(interfaces())}), effort_);
  for (const int held : held_) effort_[held] = 0;
  if (effort != effort_.data()) std::copy(effort_.begin(), effort_.end(), effort);
}

// In packs for more than one point: a pack costs the same for unused lanes.
void CompliantSystem::evaluate(CompliantPoints points) {
  const bool needs_drive = drive_ != nullptr && (points.dydt != nullptr || points.acceleration != nullptr);
  if (needs_drive) {
    const std::size_t count = points.count;
    points.efforts = [](void* self, double t, const double* q, const double* v, const InterfaceLoad* loads,
                        double* effort) { static_cast<CompliantSystem*>(self)->drive_efforts(t, q, v, loads, effort); };
    points.drive = this;
    const auto want = [&](auto& buffer, auto*& wanted, std::size_t each) {
      if (wanted != nullptr) return;
      buffer.resize(std::max(buffer.size(), count * each));
      wanted = buffer.data();
    };
    want(point_q_, points.q, now_.q.size());
    want(point_v_, points.v, now_.v.size());
    want(point_loads_, points.loads, interfaces_.size());
  }
  if (packs_ && points.count > 1 && !shapes_act_) {
    packs_->evaluate(points);
  } else {
    evaluate_here(points);
  }
}

// Sequentially, in doubles.
void CompliantSystem::evaluate_here(const CompliantPoints& points) {
  const auto store = [](const auto& from, auto* rows, std::size_t k) {
    if (rows != nullptr) std::copy(from.begin(), from.end(), rows + k * from.size());
  };
  const auto row = [](const auto* rows, std::size_t k, std::size_t size) { return rows + k * size; };
  for (std::size_t k = 0; k < static_cast<std::size_t>(points.count); ++k) {
    const double* const y = row(points.y, k, size());
    kernel_->load(points.t[k], y);
    store(kernel_->loads(), points.loads, k);
    store(kernel_->q(), points.q, k);
    store(kernel_->v(), points.v, k);
    if (shapes_act_ && (points.dydt != nullptr || points.acceleration != nullptr)) {
      std::copy(kernel_->q().begin(), kernel_->q().end(), point_state_.q.begin());
      std::copy(kernel_->v().begin(), kernel_->v().end(), point_state_.v.begin());
      load_shapes(y, point_state_);
      if (shape_samples_ != nullptr) {
        const ContactSet& contacts = shapes_->contacts();
        ShapeSample& sample = shape_samples_->emplace_back();
        sample.wrenches.assign(shapes_->wrenches().begin(), shapes_->wrenches().end());
        for (std::size_t g = 0; g < contacts.groups(); ++g) sample.groups.push_back(contacts.group(g));
        sample.from_fixed = from_fixed({y, static_cast<std::size_t>(size())});
      }
    }
    const bool moves = points.dydt != nullptr && (kernel_->has_rates() || loop_solver_);
    const double* effort = nullptr;
    if (points.acceleration != nullptr || moves) {
      if (points.efforts != nullptr) {
        points.efforts(points.drive, points.t[k], row(points.q, k, now_.q.size()), row(points.v, k, now_.v.size()),
                       row(points.loads, k, interfaces_.size()), effort_.data());
        effort = effort_.data();
      }
      kernel_->accelerate(effort);
      if (loop_solver_) close_accelerations();
      if (multipliers_ != nullptr)
        multipliers_->emplace_back(loop_solver_->multipliers().begin(), loop_solver_->multipliers().end());
    }
    store(kernel_->acceleration(), points.acceleration, k);
    if (points.dydt == nullptr) continue;
    kernel_->rates(y, effort, points.dydt + k * size());
    if (loop_solver_) add_loop_rates(points.dydt + k * size());
    if (shapes_act_) add_shape_rates(points.dydt + k * size());
  }
}

void CompliantSystem::rates(double t, std::span<const double> y, std::span<double> dydt) {
  rates(std::span(&t, 1), y, dydt, {});
}

void CompliantSystem::rates(std::span<const double> t, std::span<const double> y, std::span<double> dydt,
                            std::span<InterfaceLoad> loads) {
  CompliantPoints points;
  points.count = static_cast<int>(t.size());
  points.t = t.data(), points.y = y.data(), points.dydt = dydt.data();
  if (!loads.empty()) points.loads = loads.data();
  evaluate(points);
}

void CompliantSystem::evaluate_loads(std::span<const double> t, std::span<const double> y,
                                     std::span<InterfaceLoad> loads) {
  CompliantPoints points;
  points.count = static_cast<int>(t.size());
  points.t = t.data(), points.y = y.data(), points.loads = loads.data();
  evaluate(points);
}

void CompliantSystem::sample(std::span<const double> t, std::span<const double> y, Sampled& at) {
  at.q.resize(t.size() * now_.q.size()), at.v.resize(t.size() * now_.v.size());
  at.acceleration.resize(at.v.size()), at.loads.resize(t.size() * interfaces_.size());
  CompliantPoints points;
  points.count = static_cast<int>(t.size());
  points.t = t.data(), points.y = y.data(), points.loads = at.loads.data();
  points.q = at.q.data(), points.v = at.v.data(), points.acceleration = at.acceleration.data();
  at.shapes.clear(), at.multipliers.clear();
  if (shapes_act_) shape_samples_ = &at.shapes;
  if (loop_solver_) multipliers_ = &at.multipliers;
  evaluate(points);
  shape_samples_ = nullptr, multipliers_ = nullptr;
  if (shapes_) at.shapes.resize(t.size());
}

// --- Contacts between shapes ---

// Pairs that may touch => the trees between which they exchange impulses, and the trees that take part from now on.
void CompliantSystem::begin_shapes() {
  const ContactSet& contacts = shapes_->contacts();
  for (std::size_t pair = 0; pair < contacts.size(); ++pair) {
    const auto [body_a, body_b] = contacts.bodies_of(pair);
    for (const int body : {body_a, body_b}) {
      if (body >= 0) taking_part_.push_back(model_.bodies()[body].root);
    }
    const int a = body_a < 0 ? -1 : tree_of_[body_a], b = body_b < 0 ? -1 : tree_of_[body_b];
    if (a != b && channel_of(a, b) < 0) channels_.push_back({std::max(a, b), std::min(a, b)});
  }
  std::sort(taking_part_.begin(), taking_part_.end());
  taking_part_.erase(std::unique(taking_part_.begin(), taking_part_.end()), taking_part_.end());
  for (std::size_t i = 0; i < springs_.size(); ++i) springs_[i].counted = takes_part(model_.springs()[i]);
  tables_.channels = channels_.data(), tables_.channel_count = static_cast<int>(channels_.size());
  shapes_act_ = true;
  shapes_->results().touched = true;
  lay_out();
}

// Both trees of a pair of shapes => index of the channel of its impulse, after those of loops; -1: none.
int CompliantSystem::channel_of(int tree_a, int tree_b) const {
  const int first = std::max(tree_a, tree_b), second = std::min(tree_a, tree_b);
  for (std::size_t i = loops_.size(); i < channels_.size(); ++i) {
    if (channels_[i].first == first && channels_[i].second == second) return static_cast<int>(i);
  }
  return -1;
}

// y before begin_shapes() => y with the numbers of shapes, which are zero.
std::vector<double> CompliantSystem::with_shape_numbers(std::span<const double> y) const {
  const auto from = static_cast<std::ptrdiff_t>(loop_offset(static_cast<int>(loops_.size())));
  std::vector<double> now(y.begin(), y.begin() + from);
  now.resize(tables_.loss_at, 0.0);
  now.insert(now.end(), y.begin() + from, y.end());
  now.resize(tables_.size, 0.0);
  return now;
}

// y at an instant => modes, and y with the deformations of the pairs that are now in contact with friction.
std::vector<double> CompliantSystem::choose_shape_modes(double t, std::span<const double> y) {
  const std::span<const double> tail = y.subspan(tables_.loss_at);
  std::vector<double> now(y.begin(), y.begin() + stick_at_);
  shapes_->set_sticks(y.subspan(stick_at_, tables_.loss_at - stick_at_));
  shapes_->choose_modes(t, now_);
  lay_out();
  now.resize(tables_.loss_at);
  shapes_->get_sticks(std::span(now).subspan(stick_at_));
  now.insert(now.end(), tail.begin(), tail.end());
  return now;
}

std::vector<double> CompliantSystem::arranged(std::span<const double> numbers, const ShapeNumbers& added) const {
  const int loops = static_cast<int>(loops_.size()), from = loop_offset(loops);
  std::vector<double> all(numbers.begin(), numbers.begin() + from);
  for (int i = 6 * loops; i < 6 * tables_.channel_count; ++i) all.push_back(i % 6 < 3 ? added.moment : added.impulse);
  all.resize(tables_.loss_at, added.stick);
  all.insert(all.end(), numbers.begin() + from, numbers.end());
  all.resize(tables_.size, added.integral);
  return all;
}

void CompliantSystem::begin_shape_step(double t, std::span<const double> y) {
  place(t, y);
  shapes_->begin_step(now_);
}

bool CompliantSystem::end_shape_step(double t, std::span<const double> y, double duration) {
  place(t, y);
  return shapes_->end_step(now_, duration);
}

// y, state => forces of shapes there; they act in the kernel's next accelerations.
void CompliantSystem::load_shapes(const double* y, State& state) {
  shapes_->set_sticks({y + stick_at_, static_cast<std::size_t>(tables_.loss_at - stick_at_)});
  shapes_->evaluate(state);
  kernel_->set_forces(shapes_->link_forces());
}

// Wrench or impulse on a body about a point => added to the channel of both trees in y or its rates.
void CompliantSystem::add_shape_impulse(int body_a, int body_b, const Vector3d& p_WC, const Wrenchd& on_b,
                                        double* y) const {
  const int a = body_a < 0 ? -1 : tree_of_[body_a], b = body_b < 0 ? -1 : tree_of_[body_b];
  if (a == b) return;
  const Wrenchd F = shift(b > a ? on_b : -on_b, tables_.channel_point - p_WC);
  double* const at = y + tables_.channel_at + 6 * channel_of(a, b);
  for (int k = 0; k < 3; ++k) at[k] += F.angular[k], at[3 + k] += F.linear[k];
}

// Forces of shapes => rates of the channels' impulses about their common point, as (12.1), and of the other numbers of
// shapes. Each force enters once, so that total momentum is conserved to rounding error.
void CompliantSystem::add_shape_rates(double* dydt) {
  shapes_->each_force([&](int body_a, int body_b, const Vector3d& p_WC, const Wrenchd& on_b) {
    add_shape_impulse(body_a, body_b, p_WC, on_b, dydt);
  });
  shapes_->stick_rates({dydt + stick_at_, static_cast<std::size_t>(tables_.loss_at - stick_at_)});
  shapes_->integral_rates({dydt + shape_at_, static_cast<std::size_t>(tables_.size - shape_at_)});
}

Momentumd CompliantSystem::from_fixed(std::span<const double> y) const {
  Momentumd sum = Momentumd::zero();
  for (std::size_t i = loops_.size(); i < channels_.size(); ++i) {
    if (channels_[i].second >= 0) continue;
    const double* const P = &y[tables_.channel_at + 6 * i];
    sum += shift(Momentumd{{P[0], P[1], P[2]}, {P[3], P[4], P[5]}}, -tables_.channel_point);
  }
  return sum;
}

// --- Events ---

void CompliantSystem::event_values(double t, std::span<const double> y, std::span<double> g) {
  place(t, y);
  event_values(loads(), g);
  if (shapes_) g.back() = shapes_->margin(t, now_);
}

// Loads => two event functions per contact, by its phase: deformation, signed force or the factor 1 + a times the
// deformation rate of (12.6). Unused functions are 1. A sign change ends the phase (docs/theory, section 12, Contacts).
void CompliantSystem::event_values(std::span<const InterfaceLoad> loads, std::span<double> g) const {
  for (std::size_t i = 0; i < phase.size(); ++i) {
    const InterfaceLoad& load = loads[i];
    const InterfaceTable& contact = interfaces_[i];
    double &first = g[2 * i], &second = g[2 * i + 1];
    first = second = 1;
    const bool viscous = contact.model == ContactForceModel::kelvin_voigt;
    const bool crossley = contact.model == ContactForceModel::hunt_crossley;
    switch (phase[i]) {
      case ContactPhase::apart:
        first = load.deformation;
        break;
      case ContactPhase::pressing:
        // Kelvin-Voigt's force vanishes once, before the deformation; Hunt and Crossley's with either factor.
        first = viscous ? load.signed_force : load.deformation;
        if (crossley) second = 1 + contact.damping * load.rate;
        break;
      case ContactPhase::relaxing:
        first = load.deformation;
        second = viscous ? load.signed_force : 1 + contact.damping * load.rate;
    }
  }
}

void CompliantSystem::event_directions(std::span<int> directions) const {
  for (std::size_t i = 0; i < phase.size(); ++i) {
    directions[2 * i] = phase[i] == ContactPhase::apart ? 1 : -1;
    directions[2 * i + 1] = phase[i] == ContactPhase::relaxing ? 1 : -1;
  }
  if (shapes_) directions.back() = -1;
}

// Contact, index of its event function that crossed zero, load => next phase: apart -> pressing; relaxing -> apart or
// pressing; pressing -> relaxing if the surface is still indented, else apart.
ContactPhase CompliantSystem::phase_after(int contact, int which, const InterfaceLoad& load) const {
  switch (phase[contact]) {
    case ContactPhase::apart:
      return ContactPhase::pressing;
    case ContactPhase::relaxing:
      return which == 0 ? ContactPhase::apart : ContactPhase::pressing;
    default:
      break;
  }
  if (which == 1) return ContactPhase::relaxing;
  const InterfaceTable& c = interfaces_[contact];
  return c.model == ContactForceModel::kelvin_voigt && c.damping > 0 && load.deformation > 0 ? ContactPhase::relaxing
                                                                                             : ContactPhase::apart;
}

}  // namespace grapnel
