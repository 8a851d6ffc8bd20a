#include "plant_instance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "grapnel/plant/plant_package.hpp"
#include "grapnel/plant/plant_problem.hpp"
#include "grapnel/plant/plant_run.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel::fmu {
namespace {

using VariableType = PlantVariable::Type;
using Causality = PlantVariable::Causality;

// Times of the master, who adds up its steps, equal ours if they differ by less than this fraction of a period.
constexpr double kSame = 1e-6;

const char* name_of(Mode mode) {
  switch (mode) {
    case Mode::instantiated:
      return "before initialization mode";
    case Mode::initialization:
      return "in initialization mode";
    case Mode::stepping:
      return "in step mode";
    case Mode::terminated:
      return "after termination";
    case Mode::failed:
      break;
  }
  return "after an error; only reset and free are allowed";
}

const char* name_of(VariableType type) {
  switch (type) {
    case VariableType::real:
      return "a real number";
    case VariableType::whole:
      return "an integer";
    case VariableType::boolean:
      break;
  }
  return "a truth value";
}

// All errors of a scenario in one line.
std::string text_of(const InputError& error) {
  std::string text = "the scenario in the FMU's resources cannot be used";
  for (const Fault& fault : error.faults()) text += "; " + fault.text();
  return text;
}

}  // namespace

std::filesystem::path resources_path(const char* location) {
  if (!location || *location == 0) throw std::runtime_error("the resource location is missing");
  std::string_view uri = location;
  if (!uri.starts_with("file:")) return std::filesystem::path(uri);
  uri.remove_prefix(5);
  // "file:/a", "file:///a" and "file://localhost/a".
  if (uri.starts_with("//")) {
    uri.remove_prefix(2);
    if (uri.starts_with("localhost/")) uri.remove_prefix(9);
  }
  if (!uri.starts_with("/"))
    throw std::runtime_error(fmt::format("the resource location {} is not on this machine", location));
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%' || i + 2 >= uri.size()) {
      path += uri[i];
      continue;
    }
    path += static_cast<char>(std::stoi(std::string(uri.substr(i + 1, 2)), nullptr, 16));
    i += 2;
  }
  return path;
}

struct PlantInstance::Parts {
  explicit Parts(const std::filesystem::path& folder) : resources(folder), package(read_plant(folder)) {}
  const std::filesystem::path resources;
  const PlantPackage package;
  std::unique_ptr<PlantRun> run;
};

PlantInstance::PlantInstance(const std::filesystem::path& resources, const std::string& token, Log log)
    : parts_(std::make_unique<Parts>(resources)), log_(std::move(log)) {
  const PlantPackage& package = parts_->package;
  if (token != package.token)
    throw std::runtime_error(
        fmt::format("the token {} is not that of the model in {}, {}", token, resources.string(), package.token));
  try {
    variables_ = plant_variables(load_plant(package, resources, {}), package.parameters);
  } catch (const InputError& error) {
    throw std::runtime_error(text_of(error));
  }
  reset();
}

PlantInstance::~PlantInstance() = default;

bool PlantInstance::has_ended() const { return parts_->run && parts_->run->has_ended(); }

void PlantInstance::check_mode(std::initializer_list<Mode> allowed) const {
  if (std::find(allowed.begin(), allowed.end(), mode_) == allowed.end())
    throw Refused(Status::error, fmt::format("must not be called {}", name_of(mode_)));
}

Status PlantInstance::tell(const char* name, Status status, const std::string& why) const {
  const bool failed = status >= Status::error;
  log_(status, failed ? "logStatusError" : "logStatusDiscard", fmt::format("{}: {}", name, why));
  return status;
}

const PlantVariable& PlantInstance::variable_at(VariableType type, unsigned reference) const {
  if (reference == 0 || reference > variables_.all.size())
    throw Refused(Status::error, fmt::format("no variable has the value reference {}", reference));
  const PlantVariable& variable = variables_.all[reference - 1];
  if (variable.type != type)
    throw Refused(Status::error, fmt::format("{} is {}, not {}", variable.name, name_of(variable.type), name_of(type)));
  return variable;
}

void PlantInstance::set(VariableType type, unsigned reference, double value) {
  const PlantVariable& variable = variable_at(type, reference);
  if (variable.causality == Causality::output)
    throw Refused(Status::error, fmt::format("{} is an output and cannot be set", variable.name));
  if (!std::isfinite(value))
    throw Refused(Status::error, fmt::format("{} is set to {}, must be finite", variable.name, value));
  if (variable.causality == Causality::parameter) {
    if (mode_ == Mode::stepping)
      throw Refused(Status::error,
                    fmt::format("{} is a fixed parameter, which can be set before the run only", variable.name));
    parts_->run.reset();
  }
  values_[reference - 1] = value;
}

double PlantInstance::get(VariableType type, unsigned reference) {
  if (reference == kTimeReference && type == VariableType::real) return time();
  const PlantVariable& variable = variable_at(type, reference);
  if (variable.causality == Causality::output) {
    if (mode_ == Mode::instantiated)
      throw Refused(Status::error, fmt::format("{} is available only from initialization mode on", variable.name));
    if (mode_ == Mode::initialization) need_run();
  }
  return values_[reference - 1];
}

void PlantInstance::set_start(double start) {
  if (!std::isfinite(start)) throw Refused(Status::error, "the start time is not finite");
  start_ = start, has_start_ = true;
}

// Creates the run, at its first sample.
void PlantInstance::need_run() {
  if (parts_->run) return;
  try {
    const auto first = values_.begin();
    const std::vector<double> parameters(first, first + static_cast<std::ptrdiff_t>(variables_.parameters));
    CaptureProblem plant = load_plant(parts_->package, parts_->resources, parameters);
    parts_->run = std::make_unique<PlantRun>(std::move(plant), variables_);
    parts_->run->begin();
    take_outputs();
  } catch (const InputError& error) {
    parts_->run.reset();
    throw PlantError(text_of(error));
  } catch (...) {
    parts_->run.reset();
    throw;
  }
}

void PlantInstance::take_outputs() {
  const std::vector<double> numbers = parts_->run->outputs().numbers();
  if (numbers.size() != variables_.outputs) throw std::logic_error("the plant's outputs differ from its description");
  std::copy(numbers.begin(), numbers.end(), values_.begin() + static_cast<std::ptrdiff_t>(variables_.first_output()));
  last_time_ = parts_->run->time();
}

void PlantInstance::enter_initialization() { mode_ = Mode::initialization; }

void PlantInstance::exit_initialization() {
  need_run();
  mode_ = Mode::stepping;
}

double PlantInstance::time() const { return start_ + last_time_; }

bool PlantInstance::step(double time, double size, Status no_multiple) {
  const double period = parts_->run->period(), same = kSame * period;
  if (!(std::abs(time - this->time()) <= same + 1e-12 * std::abs(time)))
    throw Refused(Status::error, fmt::format("the communication point is {} [s], expected {}", time, this->time()));
  const double periods = size / period;
  if (!(periods >= 1 - kSame) || !(std::abs(periods - std::round(periods)) <= kSame * std::max(1.0, periods)))
    throw Refused(
        no_multiple,
        fmt::format("the communication step is {} [s], must be a multiple of the control period, {}", size, period));
  if (parts_->run->has_ended())
    throw Refused(Status::discard, fmt::format("the run has ended at t = {} [s]", this->time()));
  std::vector<double> inputs(variables_.inputs);
  std::copy_n(values_.begin() + static_cast<std::ptrdiff_t>(variables_.first_input()), inputs.size(), inputs.begin());
  parts_->run->step((std::round(parts_->run->time() / period) + std::round(periods)) * period, inputs);
  take_outputs();
  if (parts_->run->has_ended() && last_time_ < time - start_ + size - same)
    throw Refused(Status::discard, fmt::format("the run ended within the step, at t = {} [s]", this->time()));
  return parts_->run->has_ended();
}

void PlantInstance::terminate() {
  parts_->run.reset();
  mode_ = Mode::terminated;
}

void PlantInstance::reset() {
  parts_->run.reset();
  mode_ = Mode::instantiated;
  values_.assign(variables_.all.size(), 0.0);
  for (std::size_t i = 0; i < variables_.first_output(); ++i) values_[i] = variables_.all[i].start;
  start_ = last_time_ = 0;
  has_start_ = false;
}

}  // namespace grapnel::fmu
