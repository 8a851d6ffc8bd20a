// An exported plant is commanded from outside and carries no library for ZIP archives. The reader of scenarios unpacks
// an FMU only if a scenario names one, which an exported one never does.
#include "grapnel/control/fmu_archive.hpp"
#include "grapnel/control/fmu_description.hpp"

namespace grapnel::fmi {

void unpack_archive(const std::filesystem::path&, const std::filesystem::path&) {
  throw FmuError("it cannot be a controller within an exported plant");
}

}  // namespace grapnel::fmi
