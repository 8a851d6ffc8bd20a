// An exported plant is commanded from outside, so its library cannot load FMUs as controllers. The reader of scenarios
// calls these functions only if a scenario names an FMU, which an exported one never does.
#include "grapnel/fmi/fmu_controller.hpp"

namespace grapnel::fmi {

FmuControllers::FmuControllers(const std::string&, const std::string& shown, std::string, std::string) {
  throw FmuError("the FMU '" + shown + "' cannot be a controller within an exported plant");
}
std::vector<FmuMisfit> FmuControllers::misfits(const std::vector<std::string>&, const std::string&, bool,
                                               double) const {
  return {};
}
std::shared_ptr<Controller> FmuControllers::make(const ControlTiming&, const std::string&, ControlledRobot,
                                                 const Model&) const {
  throw ControllerError("an FMU cannot be a controller within an exported plant");
}

}  // namespace grapnel::fmi
