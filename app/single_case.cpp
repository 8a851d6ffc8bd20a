#include "single_case.hpp"

#include "commands.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {

int run_single_case(const SingleCase& single, const std::filesystem::path& folder, const RunSwitches& switches) {
  const std::filesystem::path file = folder / "scenario.yaml";
  if (!may_replace(file)) return kBadInput;
  CaptureProblem problem;
  try {
    write_file_atomically(file, single.text(file));
    problem = load_scenario(file);
  } catch (const InputError& error) {
    say_faults(error.faults());
    return kBadInput;
  } catch (const std::exception& error) {
    to_stderr("{}: error: {}: {}\n", single.study.string(), single.what, error.what());
    return kBadInput;
  }
  if (!switches.quiet) {
    to_stdout("grapnel {}, {} of {} {} as scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, single.what, single.of,
              single.study.string(), file.string(), problem.sha256.substr(0, 12));
    flush_stdout();
  }
  return run_problem(problem, file, folder, switches);
}

}  // namespace grapnel::app
