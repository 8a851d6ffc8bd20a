// grapnel identify: parameters of a scenario from logs of measurements.
#include <fmt/format.h>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/compare/identification_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {

namespace fs = std::filesystem;

int identify(StudyOptions options) {
  const StopSignal stop;
  options.stop = stop.token();
  try {
    std::vector<Fault> warnings;
    const Identification identification = load_identification(options.study, options.stop, &warnings);
    print_errors(warnings);
    Terminal terminal;
    const std::optional<fs::path> folder = results_folder(options.output, options.study, Outputs::images, terminal);
    if (!folder || !may_write(identification_files(identification, *folder), terminal) ||
        !may_replace(*folder / "fitted.yaml", terminal))
      return kBadInput;
    if (!options.quiet) {
      to_stdout("grapnel {}, identification {} (sha256 {})\n\n", GRAPNEL_VERSION, options.study.string(),
                identification.sha256.substr(0, 12));
      flush_stdout();
    }
    return code_of(run_identification_folder(identification, *folder, options, terminal));
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const FitStopped&) {
    return kInterrupted;
  }
}

}  // namespace grapnel::app
