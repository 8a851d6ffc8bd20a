// grapnel linearize: the linear model of a scenario at a time, and the stability of its controllers.
#include "grapnel/linear/linearize.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "commands.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/error_text.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

enum class LinearFile { none, json, mat, unknown };

LinearFile kind_of_file(const fs::path& file) {
  if (file.empty()) return LinearFile::none;
  const std::string extension = file.extension().string();
  return extension == ".json" ? LinearFile::json : extension == ".mat" ? LinearFile::mat : LinearFile::unknown;
}

}  // namespace

int linearize(const LinearizeCommandOptions& options) {
  const LinearFile kind = kind_of_file(options.output);
  if (kind == LinearFile::unknown) {
    to_stderr("grapnel: error: -o {}: the name must end in .json or .mat\n", options.output.string());
    return kBadInput;
  }
  if (options.delay != 0 && !options.sample_time) {
    to_stderr("grapnel: error: --delay needs --sample-time\n");
    return kBadInput;
  }
  try {
    std::vector<Override> overrides;
    for (const std::string& one : options.overrides) overrides.push_back(parse_override(one));
    std::vector<Fault> warnings;
    const CaptureProblem problem = load_scenario(options.scenario, overrides, &warnings);
    Terminal terminal;
    if (kind != LinearFile::none && !may_write({options.output}, terminal)) return kBadInput;
    const fs::path folder = options.output.has_parent_path() ? options.output.parent_path() : fs::path(".");
    if (kind != LinearFile::none && ::access(folder.c_str(), W_OK) != 0) {
      to_stderr("grapnel: error: -o {}: the folder does not exist or is not writable\n", options.output.string());
      return kBadInput;
    }
    print_errors(warnings);
    const LinearModel model = linearize(problem, {options.at, options.sample_time, options.delay});
    if (!options.quiet) to_stdout("{}", linear_model_text(model));
    if (options.quiet) {
      for (const std::string& warning : model.warnings) to_stderr("grapnel: warning: {}\n", warning);
    }
    if (kind == LinearFile::json) write_file_atomically(options.output, linear_model_json(model));
    if (kind == LinearFile::mat) write_linear_model_mat(model, options.output);
    if (kind != LinearFile::none && !options.quiet) to_stdout("\n{}\n", options.output.string());
    return kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const CaptureProblemError& error) {
    to_stderr("grapnel: error: {}: {}\n", options.scenario.string(), error_text(error));
    return kBadInput;
  } catch (const LinearizeError& error) {  // of the time or the scenario
    to_stderr("grapnel: error: {}: {}\n", options.scenario.string(), error_text(error));
    return kBadInput;
  } catch (const std::runtime_error& error) {
    to_stderr("grapnel: error: {}: {}\n", options.scenario.string(), error_text(error));
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
