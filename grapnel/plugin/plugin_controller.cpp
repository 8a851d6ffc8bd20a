#include "grapnel/plugin/plugin_controller.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/plugin/guarded_call.hpp"
#include "grapnel/plugin/plugin_ends.hpp"
#include "grapnel/simulate/replay_controller.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

// --- The robot as JSON ---

Json or_null(double limit) { return std::isfinite(limit) ? Json(limit) : Json(nullptr); }

Json joint_json(const Body& body) {
  const JointDescription& joint = body.description.joint;
  return {{"name", joint.name},
          {"type", traits_of(joint.type).name},
          {"body", body.description.name},
          {"parent", body.description.parent},
          {"lower", or_null(joint.limits.lower)},
          {"upper", or_null(joint.limits.upper)},
          {"rate", or_null(joint.limits.rate)},
          {"effort", or_null(joint.limits.effort)}};
}

Json body_json(const BodyDescription& body) {
  const Symmetric3d& I = body.inertia;
  return {{"name", body.name},
          {"parent", body.parent},
          {"mass", body.mass},
          {"com", {body.com[0], body.com[1], body.com[2]}},
          {"inertia", {I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}}};
}

Json robot_json(const ControlledRobot& robot, const Model& model) {
  const int base = model.body_index(robot.base);
  Json joints = Json::array(), bodies = Json::array();
  for (const std::string& name : robot.joints)
    joints.push_back(joint_json(model.bodies()[model.joints()[joint_named(model, name)]]));
  for (const Body& body : model.bodies()) {
    if (body.root == base) bodies.push_back(body_json(body.description));
  }
  return {{"base", {{"name", robot.base}, {"is_free", model.has_free_root(base)}}},
          {"joints", joints},
          {"bodies", bodies},
          {"end_effectors", robot.end_effectors}};
}

// --- Queries available to a plugin ---

struct Asked {
  const Model& model;
  const State& state;
  const ControlledRobot& robot;
  int base;
  const std::vector<int>& velocities;
  int base_velocities;  // 6, or 0 for a base fixed to the world
};
const Asked& asked(const void* context) { return *static_cast<const Asked*>(context); }

// No exception may leave these functions: the caller is C code.
template <class Answer>
int answered(const Answer& answer) noexcept {
  try {
    answer();
    return 0;
  } catch (...) {
    return 1;
  }
}

int count_velocities(const void* context) { return static_cast<int>(asked(context).velocities.size()); }

int give_mass_matrix(const void* context, double* H) {
  return answered([&] {
    const Asked& a = asked(context);
    const Eigen::MatrixXd M = mass_matrix(a.model, a.state);
    for (const int row : a.velocities) {
      for (const int column : a.velocities) *H++ = M(row, column);
    }
  });
}

int give_bias(const void* context, double* C) {
  return answered([&] {
    const Asked& a = asked(context);
    Workspace workspace(a.model);
    std::vector<double> c(static_cast<std::size_t>(a.model.velocities()));
    bias(a.model, a.state, a.robot.gravity, workspace, c);
    for (const int v : a.velocities) *C++ = c[v];
  });
}

int give_momentum(const void* context, double* p) {
  return answered([&] {
    const Asked& a = asked(context);
    const Kinematics kinematics = forward_kinematics(a.model, a.state);
    const std::array<int, 1> root = {a.base};
    const Momentumd h = momentum_about(a.model, kinematics, center_of_mass(a.model, kinematics, root), root);
    double mass = 0;
    for (const Body& body : a.model.bodies()) mass += body.root == a.base ? body.description.mass : 0;
    for (int k = 0; k < 3; ++k) p[k] = h.angular[k], p[3 + k] = h.linear[k] + mass * a.robot.velocity[k];
  });
}

int give_jacobian(const void* context, const char* frame, double* J) {
  return answered([&] {
    const Asked& a = asked(context);
    const Eigen::MatrixXd all = generalized_jacobian(a.model, a.state, a.base, a.model.frame_index(frame));
    const std::vector<int> order = joint_velocities(a.model, a.base);  // of the Jacobian's columns
    for (Eigen::Index row = 0; row < 6; ++row) {
      for (auto v = a.velocities.begin() + a.base_velocities; v != a.velocities.end(); ++v)
        *J++ = all(row, std::find(order.begin(), order.end(), *v) - order.begin());
    }
  });
}

// Whether a plugin's table has a member, and it is set.
template <class Member>
bool has(const grapnel_controller_plugin& table, Member grapnel_controller_plugin::*member) {
  const auto* begin = reinterpret_cast<const unsigned char*>(&table);
  const auto* at = reinterpret_cast<const unsigned char*>(&(table.*member));
  return static_cast<std::size_t>(at - begin) + sizeof(Member) <= table.size && table.*member != nullptr;
}

}  // namespace

// --- Libraries ---

ControllerPlugin::ControllerPlugin(const std::string& file, const std::string& shown)
    : named_(fmt::format("the plugin '{}'", shown)) {
  const PluginCall blame(named_.c_str(), "the code that runs when it is loaded", 0);
  const FloatingPointGuard kept;
  const DirectoryGuard directory;
  library_ = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  const auto refuse = [&](const std::string& why) {
    if (library_ != nullptr) ::dlclose(library_);
    throw ControllerError(why);
  };
  if (library_ == nullptr) {
    const char* const reason = ::dlerror();
    refuse(fmt::format("{} cannot be loaded: {}", named_, reason != nullptr ? reason : "unknown reason"));
  }
  void* const symbol = ::dlsym(library_, "grapnel_controller");
  if (symbol == nullptr)
    refuse(fmt::format(
        "'{}' is not a plugin: it does not export the function grapnel_controller(), which grapnel_controller.h "
        "declares (in C++ as extern \"C\")",
        shown));
  try {
    functions_ = reinterpret_cast<const grapnel_controller_plugin* (*)()>(symbol)();
  } catch (...) {
    refuse(fmt::format("{} threw a C++ exception from grapnel_controller()", named_));
  }
  if (functions_ == nullptr) refuse(fmt::format("{}: grapnel_controller() returned null", named_));
  if (const std::string why = fault(); !why.empty()) refuse(why);
}

ControllerPlugin::ControllerPlugin(const grapnel_controller_plugin& functions, std::string named)
    : named_(std::move(named)), functions_(&functions) {
  if (const std::string why = fault(); !why.empty()) throw ControllerError(why);
}

std::string ControllerPlugin::fault() const {
  constexpr std::size_t kHead = offsetof(grapnel_controller_plugin, version) + sizeof(std::uint32_t);
  if (functions_->size < kHead || functions_->version != GRAPNEL_CONTROLLER_VERSION)
    return fmt::format(
        "{} has version {} of the controller interface, expected {}; build it with the grapnel_controller.h of this "
        "Grapnel",
        named_, functions_->size < kHead ? 0 : functions_->version, GRAPNEL_CONTROLLER_VERSION);
  const auto lacks = [&](const char* name) { return fmt::format("{} has no function {}()", named_, name); };
  if (!has(*functions_, &grapnel_controller_plugin::create)) return lacks("create");
  if (!has(*functions_, &grapnel_controller_plugin::update)) return lacks("update");
  if (!has(*functions_, &grapnel_controller_plugin::destroy)) return lacks("destroy");
  return {};
}

ControllerPlugin::~ControllerPlugin() {
  if (library_ == nullptr) return;
  const PluginCall blame(named_.c_str(), "the code that runs when it is unloaded", 0);
  const FloatingPointGuard kept;
  const DirectoryGuard directory;
  ::dlclose(library_);
}

std::shared_ptr<const ControllerPlugin> open_plugin(const std::string& file, const std::string& shown) {
  return std::make_shared<const ControllerPlugin>(file.empty() ? shown : file, shown);
}

std::string plugin_fault(const std::string& file, const std::string& shown) {
  try {
    open_plugin(file, shown);
    return {};
  } catch (const ControllerError& error) {
    return error.what();
  }
}

// --- Instances ---

PluginController::PluginController(std::shared_ptr<const ControllerPlugin> plugin, const ControlTiming& timing,
                                   const std::string& parameters, ControlledRobot robot, const Model& model)
    : plugin_(std::move(plugin)),
      robot_(std::move(robot)),
      position_(robot_.joints.size()),
      rate_(position_),
      desired_position_(position_),
      desired_rate_(position_),
      desired_acceleration_(position_),
      effort_(position_) {
  end_late_plugins();
  const std::string description = robot_json(robot_, model).dump();
  const grapnel_controller_setup setup{
      sizeof(setup), parameters.c_str(), description.c_str(),         static_cast<int>(robot_.joints.size()),
      timing.period, timing.delay,       robot_.commands_base ? 1 : 0};
  std::array<char, 1024> error{};
  const int failed = guarded(plugin_->named(), "create", 0, [&] {
    return plugin_->functions().create(&setup, &instance_, error.data(), error.size());
  });
  error.back() = 0;
  if (failed != 0)
    throw ControllerError(fmt::format("{} created no controller: {}", plugin_->named(),
                                      error[0] != 0 ? error.data() : fmt::format("create() returned {}", failed)));
}

PluginController::~PluginController() {
  end_plugin([plugin = plugin_, instance = instance_, time = time_] {
    guarded(plugin->named(), "destroy", time, [&] { plugin->functions().destroy(instance); });
  });
}

void PluginController::fail(const char* what, double time) const {
  const char* said = nullptr;
  if (has(plugin_->functions(), &grapnel_controller_plugin::last_error))
    said = guarded(plugin_->named(), "last_error", time, [&] { return plugin_->functions().last_error(instance_); });
  throw ControllerError(fmt::format("at t = {:.9g} s {}() of {} failed: {}", time, what, plugin_->named(),
                                    said != nullptr && said[0] != 0 ? said : "it states no reason"));
}

void PluginController::begin_piece(const Model& model, double time) {
  time_ = time;
  base_ = model.body_index(robot_.base);
  joints_.clear();
  velocities_.clear();
  const int first = model.bodies()[base_].v;
  if (model.has_free_root(base_)) {
    for (int k = 0; k < 6; ++k) velocities_.push_back(first + k);
  }
  for (const std::string& name : robot_.joints) {
    joints_.push_back(static_cast<int>(joint_named(model, name)));
    velocities_.push_back(model.bodies()[model.joints()[joints_.back()]].v);
  }
  wheels_.clear();
  for (const std::string& name : robot_.wheels)
    wheels_.push_back(model.bodies()[model.joints()[joint_named(model, name)]].v);
  for (const int v : joint_velocities(model, base_)) {
    if (std::find(velocities_.begin(), velocities_.end(), v) == velocities_.end()) velocities_.push_back(v);
  }
  if (++piece_ > 0 || !has(plugin_->functions(), &grapnel_controller_plugin::reset)) return;
  if (guarded(plugin_->named(), "reset", time, [&] { return plugin_->functions().reset(instance_, time); }) != 0)
    fail("reset", time);
}

void PluginController::gather(const ControlInput& input) {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const JointPoint &sensed = input.sensed[joints_[j]], &desired = input.reference[joints_[j]];
    position_[j] = sensed.position, rate_[j] = sensed.rate;
    desired_position_[j] = desired.position, desired_rate_[j] = desired.rate;
    desired_acceleration_[j] = desired.acceleration;
  }
  std::fill(effort_.begin(), effort_.end(), 0.0);
}

// Sensor readings beyond the state.
void PluginController::gather_readings(const ControlInput& input) {
  wheel_rate_.clear(), target_pose_.clear(), target_motion_.clear();
  wrench_.assign(6 * robot_.end_effectors.size(), std::numeric_limits<double>::quiet_NaN());
  for (const int v : wheels_) wheel_rate_.push_back(input.state.v[v]);
  if (!input.readings) return;
  const auto add = [](std::vector<double>& list, const Vector3d& x) { list.insert(list.end(), x.e, x.e + 3); };
  wrench_.clear();
  for (const Wrenchd& F : input.readings->wrists) add(wrench_, F.linear), add(wrench_, F.angular);
  for (const SensorReadings::Target& target : input.readings->targets) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const bool is_read = std::isfinite(target.X_BT.R(0, 0));
    const Quaterniond q = is_read ? quaternion_from(target.X_BT.R) : Quaterniond{nan, nan, nan, nan};
    add(target_pose_, target.X_BT.p);
    target_pose_.insert(target_pose_.end(), {q.w, q.x, q.y, q.z});
    add(target_motion_, target.V_BT.linear), add(target_motion_, target.V_BT.angular);
  }
}

void PluginController::update(const ControlInput& input, ControlCommand& command) {
  time_ = input.time;
  gather(input);
  gather_readings(input);
  const Posed X_WB = root_pose(input.model, input.state, base_);
  const Twistd V_WB = root_twist(input.model, input.state, base_);
  const Quaterniond q = quaternion_from(X_WB.R);
  const Vector3d p = X_WB.p + robot_.origin + input.time * robot_.velocity, v = V_WB.linear + robot_.velocity;
  const Vector3d w = transpose(X_WB.R) * V_WB.angular;
  const grapnel_controller_input in{sizeof(in),
                                    input.time,
                                    piece_,
                                    static_cast<int>(joints_.size()),
                                    position_.data(),
                                    rate_.data(),
                                    desired_position_.data(),
                                    desired_rate_.data(),
                                    desired_acceleration_.data(),
                                    {p[0], p[1], p[2]},
                                    {q.w, q.x, q.y, q.z},
                                    {v[0], v[1], v[2]},
                                    {w[0], w[1], w[2]},
                                    static_cast<int>(wrench_.size() / 6),
                                    wrench_.data(),
                                    static_cast<int>(wheel_rate_.size()),
                                    wheel_rate_.data(),
                                    static_cast<int>(target_pose_.size() / 7),
                                    target_pose_.data(),
                                    target_motion_.data()};
  const Asked context{input.model, input.state, robot_, base_, velocities_, input.model.has_free_root(base_) ? 6 : 0};
  const grapnel_controller_access access{sizeof(access), &context,      count_velocities, give_mass_matrix,
                                         give_bias,      give_momentum, give_jacobian};
  grapnel_controller_output out{sizeof(out), effort_.data(), {0, 0, 0}};
  const int failed = guarded(plugin_->named(), "update", input.time,
                             [&] { return plugin_->functions().update(instance_, &in, &access, &out); });
  if (failed != 0) fail("update", input.time);
  const auto refuse = [&](const std::string& what) {
    throw ControllerError(
        fmt::format("at t = {:.9g} s {} returns {}, which is not finite", input.time, plugin_->named(), what));
  };
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (!std::isfinite(effort_[j])) refuse(fmt::format("an effort of {} at joint '{}'", effort_[j], robot_.joints[j]));
  }
  for (const double torque : out.base_torque) {
    if (robot_.commands_base && !std::isfinite(torque)) refuse(fmt::format("a torque of {} N m on the base", torque));
  }
  for (std::size_t j = 0; j < joints_.size(); ++j) command.effort[joints_[j]] = effort_[j];
  command.base_torque = {out.base_torque[0], out.base_torque[1], out.base_torque[2]};
}

std::vector<unsigned char> PluginController::save() {
  const grapnel_controller_plugin& functions = plugin_->functions();
  if (!has(functions, &grapnel_controller_plugin::save))
    throw ControllerError(fmt::format("{} has no function save()", plugin_->named()));
  const auto ask = [&](void* bytes, std::size_t count) {
    return guarded(plugin_->named(), "save", time_, [&] { return functions.save(instance_, bytes, count); });
  };
  std::vector<unsigned char> bytes(ask(nullptr, 0));
  ask(bytes.data(), bytes.size());
  return bytes;
}

void PluginController::restore(const std::vector<unsigned char>& bytes) {
  const grapnel_controller_plugin& functions = plugin_->functions();
  if (!has(functions, &grapnel_controller_plugin::restore))
    throw ControllerError(fmt::format("{} has no function restore()", plugin_->named()));
  const int failed = guarded(plugin_->named(), "restore", time_,
                             [&] { return functions.restore(instance_, bytes.data(), bytes.size()); });
  if (failed != 0) fail("restore", time_);
}

}  // namespace grapnel
