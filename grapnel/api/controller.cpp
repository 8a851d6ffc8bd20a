#include "grapnel/api/controller.hpp"

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "grapnel/control/plugin_controller.hpp"

namespace grapnel {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void answered(int failed, const std::string& what) {
  if (failed != 0) throw std::runtime_error("the model cannot compute " + what);
}

// --- A controller of the program with the C interface ---

struct ProgramController {
  ControllerUpdate update;
  bool has_free_base;
  std::string error;
};
ProgramController& controller_at(void* instance) { return *static_cast<ProgramController*>(instance); }

struct NewController {
  const std::function<ControllerUpdate()>& make;
  bool has_free_base;
};
// The controller that create() makes; create() runs on the thread that requests it.
thread_local const NewController* t_new = nullptr;

int create_controller(const grapnel_controller_setup*, void** instance, char* error, std::size_t error_size) {
  try {
    *instance = new ProgramController{t_new->make(), t_new->has_free_base, {}};
    return 0;
  } catch (const std::exception& thrown) {
    std::snprintf(error, error_size, "%s", thrown.what());
    return 1;
  }
}

int update_controller(void* instance, const grapnel_controller_input* input, const grapnel_controller_access* access,
                      grapnel_controller_output* output) {
  ProgramController& own = controller_at(instance);
  try {
    own.update(*input, ControllerModel(*access, own.has_free_base), *output);
    return 0;
  } catch (const std::exception& thrown) {
    own.error = thrown.what();
    return 1;
  }
}

void destroy_controller(void* instance) { delete static_cast<ProgramController*>(instance); }

const char* controller_error(void* instance) { return controller_at(instance).error.c_str(); }

constexpr grapnel_controller_plugin kProgramFunctions = {sizeof(grapnel_controller_plugin),
                                                         GRAPNEL_CONTROLLER_VERSION,
                                                         create_controller,
                                                         nullptr,
                                                         update_controller,
                                                         nullptr,
                                                         nullptr,
                                                         destroy_controller,
                                                         controller_error};

class ProgramControllers final : public ControllerSource {
 public:
  ProgramControllers(std::function<ControllerUpdate()> make, const std::string& name)
      : make_(std::move(make)),
        functions_(std::make_shared<const ControllerPlugin>(kProgramFunctions, "the controller '" + name + "'")) {}

  std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters, ControlledRobot robot,
                                   const Model& model) const override {
    const NewController fresh{make_, model.has_free_root(model.body_index(robot.base))};
    t_new = &fresh;
    return std::make_shared<PluginController>(functions_, timing, parameters, std::move(robot), model);
  }

 private:
  std::function<ControllerUpdate()> make_;
  std::shared_ptr<const ControllerPlugin> functions_;
};

}  // namespace

Eigen::MatrixXd ControllerModel::mass_matrix() const {
  RowMajor M(velocities(), velocities());
  answered(access_.mass_matrix(access_.context, M.data()), "its mass matrix");
  return M;
}

Eigen::VectorXd ControllerModel::bias() const {
  Eigen::VectorXd c(velocities());
  answered(access_.bias(access_.context, c.data()), "its bias");
  return c;
}

Momentumd ControllerModel::momentum() const {
  double h[6];
  answered(access_.momentum(access_.context, h), "its momentum");
  return {{h[0], h[1], h[2]}, {h[3], h[4], h[5]}};
}

Eigen::MatrixXd ControllerModel::generalized_jacobian(const std::string& end_effector) const {
  RowMajor J(6, velocities() - base_velocities_);
  answered(access_.generalized_jacobian(access_.context, end_effector.c_str(), J.data()),
           "the generalized Jacobian of '" + end_effector + "'");
  return J;
}

void set_controller(CaptureProblem& problem, std::function<ControllerUpdate()> make, const std::string& name) {
  if (!problem.control) problem.control.emplace();
  ControlSetup& control = *problem.control;
  control.file.clear(), control.sha256.clear(), control.fmu.clear(), control.log.reset();
  control.plugin = name;
  control.external = true;
  control.source = std::make_shared<const ProgramControllers>(std::move(make), name);
}

}  // namespace grapnel
