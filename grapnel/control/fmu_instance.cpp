#include "grapnel/control/fmu_instance.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "grapnel/control/guarded_call.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::fmi {
namespace {

const char* name_of_status(int status) {
  constexpr std::array<const char*, 6> kNames = {"ok", "warning", "discard", "error", "fatal", "pending"};
  return status >= 0 && status < static_cast<int>(kNames.size()) ? kNames.at(status) : "an unknown status";
}

// A path as a URI, with percent-encoded special characters.
std::string file_uri(const std::string& path) {
  std::string uri = "file://";
  for (const char c : path) {
    const bool is_plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || std::string_view("/-._~").find(c) != std::string_view::npos;
    uri += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

}  // namespace

template <class Call>
void FmuInstance::call(const char* name, const Call& function) {
  const std::string full = fmt::format("fmi{}{}", is_2_ ? 2 : 3, name);
  message_.clear();
  const int status = guarded(fmu_->named(), full.c_str(), time_, function);
  if (status == kOk || status == kWarning) return;
  is_lost_ = is_lost_ || status >= kError;
  throw FmuError(
      fmt::format("{}() returned {}{}{}", full, name_of_status(status), message_.empty() ? "" : ": ", message_));
}

void FmuInstance::log(int status, const std::string& text) {
  if (status >= kDiscard || message_.empty()) message_ = shortened(printable_line(text));
}

void FmuInstance::log_2(void* environment, const char*, int status, const char*, const char* message, ...) {
  if (!environment || !message) return;
  std::array<char, 512> text{};
  std::va_list values;
  va_start(values, message);
  std::vsnprintf(text.data(), text.size(), message, values);
  va_end(values);
  static_cast<FmuInstance*>(environment)->log(status, text.data());
}

void FmuInstance::log_3(void* environment, int status, const char*, const char* message) {
  if (environment && message) static_cast<FmuInstance*>(environment)->log(status, message);
}

FmuInstance::FmuInstance(std::shared_ptr<const Fmu> fmu)
    : fmu_(std::move(fmu)),
      is_2_(fmu_->model().version == 2),
      callbacks_{&FmuInstance::log_2, std::calloc, std::free, nullptr, this} {
  fmu_->acquire();
  const ModelDescription& model = fmu_->model();
  try {
    instance_ = guarded(fmu_->named(), is_2_ ? "fmi2Instantiate" : "fmi3InstantiateCoSimulation", 0, [&]() -> Instance {
      if (is_2_)
        return fmu_->function<Instantiate2>("Instantiate")(
            model.identifier.c_str(), kCoSimulation2, model.token.c_str(), file_uri(fmu_->resources().string()).c_str(),
            &callbacks_, 0, 0);
      return fmu_->function<Instantiate3>("InstantiateCoSimulation")(
          model.identifier.c_str(), model.token.c_str(), (fmu_->resources().string() + "/").c_str(), false, false,
          false, false, nullptr, 0, this, &FmuInstance::log_3, nullptr);
    });
    if (!instance_) throw FmuError(fmt::format("it created no instance{}{}", message_.empty() ? "" : ": ", message_));
  } catch (...) {
    fmu_->release();
    throw;
  }
}

FmuInstance::~FmuInstance() {
  try {
    if (is_initialized_ && !is_lost_)
      guarded(fmu_->named(), "Terminate", time_, [&] { return fmu_->function<Plain>("Terminate")(instance_); });
    guarded(fmu_->named(), "FreeInstance", time_, [&] { fmu_->function<FreeInstance>("FreeInstance")(instance_); });
  } catch (const ControllerError&) {
    // It threw an exception at its end: no further calls.
  }
  fmu_->release();
}

void FmuInstance::set_whole(const Variable& variable, int value) {
  const Reference reference = variable.reference;
  if (is_2_)
    call("SetInteger", [&] { return fmu_->function<SetInteger2>("SetInteger")(instance_, &reference, 1, &value); });
  else
    call("SetInt32", [&] { return fmu_->function<SetInt3>("SetInt32")(instance_, &reference, 1, &value, 1); });
}

void FmuInstance::set_boolean(const Variable& variable, bool value) {
  const Reference reference = variable.reference;
  const Boolean2 as_2 = value ? 1 : 0;
  call("SetBoolean", [&] {
    return is_2_ ? fmu_->function<SetBoolean2>("SetBoolean")(instance_, &reference, 1, &as_2)
                 : fmu_->function<SetBoolean3>("SetBoolean")(instance_, &reference, 1, &value, 1);
  });
}

void FmuInstance::set_text(const Variable& variable, const std::string& value) {
  const Reference reference = variable.reference;
  const char* const text = value.c_str();
  call("SetString", [&] {
    return is_2_ ? fmu_->function<SetString2>("SetString")(instance_, &reference, 1, &text)
                 : fmu_->function<SetString3>("SetString")(instance_, &reference, 1, &text, 1);
  });
}

void FmuInstance::set(std::span<const Reference> variables, std::span<const double> values) {
  if (variables.empty()) return;
  call(is_2_ ? "SetReal" : "SetFloat64", [&] {
    return is_2_ ? fmu_->function<SetReal2>("SetReal")(instance_, variables.data(), variables.size(), values.data())
                 : fmu_->function<SetFloat3>("SetFloat64")(instance_, variables.data(), variables.size(), values.data(),
                                                           values.size());
  });
}

void FmuInstance::get(std::span<const Reference> variables, std::span<double> values) {
  if (variables.empty()) return;
  call(is_2_ ? "GetReal" : "GetFloat64", [&] {
    return is_2_ ? fmu_->function<GetReal2>("GetReal")(instance_, variables.data(), variables.size(), values.data())
                 : fmu_->function<GetFloat3>("GetFloat64")(instance_, variables.data(), variables.size(), values.data(),
                                                           values.size());
  });
}

void FmuInstance::begin_initialization(double time) {
  time_ = time;
  if (is_2_) {
    call("SetupExperiment",
         [&] { return fmu_->function<SetupExperiment2>("SetupExperiment")(instance_, 0, 0, time, 0, 0); });
    call("EnterInitializationMode", [&] { return fmu_->function<Plain>("EnterInitializationMode")(instance_); });
  } else {
    call("EnterInitializationMode", [&] {
      return fmu_->function<EnterInitialization3>("EnterInitializationMode")(instance_, false, 0, time, false, 0);
    });
  }
}

void FmuInstance::end_initialization() {
  call("ExitInitializationMode", [&] { return fmu_->function<Plain>("ExitInitializationMode")(instance_); });
  is_initialized_ = true;
}

void FmuInstance::step(double time, double length) {
  time_ = time;
  if (is_2_) {
    call("DoStep", [&] { return fmu_->function<DoStep2>("DoStep")(instance_, time, length, 1); });
    return;
  }
  bool event = false, ends = false, early = false;
  double reached = time;
  call("DoStep", [&] {
    return fmu_->function<DoStep3>("DoStep")(instance_, time, length, true, &event, &ends, &early, &reached);
  });
  if (ends) throw FmuError("fmi3DoStep() requests the end of the simulation");
  if (early)
    throw FmuError(
        fmt::format("fmi3DoStep() returned early, at {:.9g} s, although early return is not allowed", reached));
}

}  // namespace grapnel::fmi
