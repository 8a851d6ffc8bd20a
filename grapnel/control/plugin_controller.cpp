#include "grapnel/control/plugin_controller.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <utility>

#include "grapnel/control/guarded_call.hpp"
#include "grapnel/control/plugin_ends.hpp"
#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/dynamics/workspace.hpp"
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
  for (const std::string& name : robot.joints) joints.push_back(joint_json(model.joint_body(joint_named(model, name))));
  for (const Body& body : model.bodies()) {
    if (body.root == base) bodies.push_back(body_json(body.description));
  }
  return {{"base", {{"name", robot.base}, {"is_free", model.has_free_root(base)}}},
          {"joints", joints},
          {"bodies", bodies},
          {"end_effectors", owner_names(SignalOwner::end_effector, robot)},
          {"wheels", owner_names(SignalOwner::wheel, robot)},
          {"gyros", owner_names(SignalOwner::gyro, robot)},
          {"thrusters", robot.thrusters},
          {"targets", owner_names(SignalOwner::target, robot)}};
}

// --- Queries available to a plugin ---

struct QueryContext {
  const Model& model;
  const State& state;
  const ControlledRobot& robot;
  int base;
  const std::vector<int>& velocities;
  int base_velocities;  // 6, or 0 for a base fixed to the world
};
const QueryContext& context_of(const void* context) { return *static_cast<const QueryContext*>(context); }

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

int count_velocities(const void* context) { return static_cast<int>(context_of(context).velocities.size()); }

int provide_mass_matrix(const void* context, double* H) {
  return answered([&] {
    const QueryContext& a = context_of(context);
    const Eigen::MatrixXd M = mass_matrix(a.model, a.state);
    for (const int row : a.velocities) {
      for (const int column : a.velocities) *H++ = M(row, column);
    }
  });
}

int provide_bias(const void* context, double* C) {
  return answered([&] {
    const QueryContext& a = context_of(context);
    Workspace workspace(a.model);
    std::vector<double> c(static_cast<std::size_t>(a.model.velocities()));
    bias(a.model, a.state, a.robot.gravity, workspace, c);
    for (const int v : a.velocities) *C++ = c[v];
  });
}

int provide_momentum(const void* context, double* p) {
  return answered([&] {
    const QueryContext& a = context_of(context);
    const Kinematics kinematics = forward_kinematics(a.model, a.state);
    const std::array<int, 1> root = {a.base};
    const Momentumd h = momentum_about(a.model, kinematics, center_of_mass(a.model, kinematics, root), root);
    double mass = 0;
    for (const Body& body : a.model.bodies()) mass += body.root == a.base ? body.description.mass : 0;
    for (int k = 0; k < 3; ++k) p[k] = h.angular[k], p[3 + k] = h.linear[k] + mass * a.robot.velocity[k];
  });
}

int provide_jacobian(const void* context, const char* frame, double* J) {
  return answered([&] {
    const QueryContext& a = context_of(context);
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
  const FloatingPointGuard environment_guard;
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
  const FloatingPointGuard environment_guard;
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
    : plugin_(std::move(plugin)), sample_(std::move(robot)), command_(sample_.robot()) {
  end_late_plugins();
  const ControlledRobot& controlled = sample_.robot();
  const std::string description = robot_json(controlled, model).dump();
  const grapnel_controller_setup setup{sizeof(setup),
                                       parameters.c_str(),
                                       description.c_str(),
                                       static_cast<int>(controlled.joints.size()),
                                       timing.period,
                                       timing.delay,
                                       controlled.commands_base ? 1 : 0,
                                       0,
                                       controlled.commands_actuators ? 1 : 0};
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
  const char* reason = nullptr;
  if (has(plugin_->functions(), &grapnel_controller_plugin::last_error))
    reason = guarded(plugin_->named(), "last_error", time, [&] { return plugin_->functions().last_error(instance_); });
  throw ControllerError(fmt::format("at t = {:.9g} s {}() of {} failed: {}", time, what, plugin_->named(),
                                    reason != nullptr && reason[0] != 0 ? reason : "it states no reason"));
}

void PluginController::begin_segment(const Model& model, double time) {
  time_ = time;
  sample_.begin_segment(model);
  velocities_.clear();
  const int first = model.bodies()[sample_.base()].v;
  if (model.has_free_root(sample_.base())) {
    for (int k = 0; k < 6; ++k) velocities_.push_back(first + k);
  }
  for (const std::size_t joint : sample_.joints()) velocities_.push_back(model.joint_body(joint).v);
  for (const int v : joint_velocities(model, sample_.base())) {
    if (std::find(velocities_.begin(), velocities_.end(), v) == velocities_.end()) velocities_.push_back(v);
  }
  if (std::exchange(has_begun_, true) || !has(plugin_->functions(), &grapnel_controller_plugin::reset)) return;
  if (guarded(plugin_->named(), "reset", time, [&] { return plugin_->functions().reset(instance_, time); }) != 0)
    fail("reset", time);
}

void PluginController::update(const ControlInput& input, ControlCommand& command) {
  time_ = input.time;
  sample_.read(input);
  command_.clear();
  const ControlledRobot& robot = sample_.robot();
  const int base = sample_.base();
  const grapnel_controller_input in = sample_.in_c();
  const QueryContext context{input.model, input.state, robot,
                             base,        velocities_, input.model.has_free_root(base) ? 6 : 0};
  const grapnel_controller_access access{sizeof(access), &context,         count_velocities, provide_mass_matrix,
                                         provide_bias,   provide_momentum, provide_jacobian};
  grapnel_controller_output out = command_.in_c();
  const int failed = guarded(plugin_->named(), "update", input.time,
                             [&] { return plugin_->functions().update(instance_, &in, &access, &out); });
  if (failed != 0) fail("update", input.time);
  command_.take(out);
  check_finite(input.time);
  command_.apply(robot, sample_.joints(), command);
}

// Reports the first command that is not finite.
void PluginController::check_finite(double time) {
  for (std::size_t c = 0; c < kCommandSignals; ++c) {
    const ControllerSignal& signal = command_signals[c].about;
    if (!is_commanded(command_signals[c], sample_.robot())) continue;
    for (std::size_t i = 0; i < command_[c].size(); ++i) {
      const double value = command_[c][i];
      if (std::isfinite(value)) continue;
      const std::vector<std::string> owners = owner_names(signal.owner, sample_.robot());
      const std::string what =
          signal.owner == SignalOwner::joint ? fmt::format("an effort of {} at joint '{}'", value, owners[i])
          : signal.owner == SignalOwner::base
              ? fmt::format("a torque of {} N m on the base", value)
              : fmt::format("a {} of {} at {} '{}'", signal.name, value, owner_name(signal.owner), owners[i]);
      throw ControllerError(
          fmt::format("at t = {:.9g} s {} returns {}, which is not finite", time, plugin_->named(), what));
    }
  }
}

std::vector<unsigned char> PluginController::save() {
  const grapnel_controller_plugin& functions = plugin_->functions();
  if (!has(functions, &grapnel_controller_plugin::save))
    throw ControllerError(fmt::format("{} has no function save()", plugin_->named()));
  const auto save_into = [&](void* bytes, std::size_t count) {
    return guarded(plugin_->named(), "save", time_, [&] { return functions.save(instance_, bytes, count); });
  };
  std::vector<unsigned char> bytes(save_into(nullptr, 0));
  save_into(bytes.data(), bytes.size());
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
