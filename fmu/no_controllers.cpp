// An exported plant is told from outside: its library has no code that loads FMUs as controllers, nor what that needs.
// The reader of scenarios asks for it where one names an FMU, which such a scenario does not.
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
