#pragma once

/// @file
/// A small master for exported plants: unpacks an FMU, loads its binary and calls its functions, of either version.

#include <gtest/gtest.h>

#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "app/program_run.hpp"
#include "grapnel/fmi/fmi_functions.hpp"
#include "grapnel/fmi/fmu.hpp"
#include "plant/short_capture.hpp"

namespace grapnel::testing {

class Master {
 public:
  explicit Master(const std::filesystem::path& file) : fmu(file, file.filename().string()) {
    for (const fmi::Variable& v : fmu.model().variables) variables_[v.name] = v;
  }
  ~Master() { free(); }
  Master(const Master&) = delete;
  Master& operator=(const Master&) = delete;

  bool is_2() const { return fmu.model().version == 2; }
  const std::map<std::string, fmi::Variable>& variables() const { return variables_; }
  fmi::Reference reference(const std::string& name) const {
    const auto it = variables_.find(name);
    EXPECT_NE(it, variables_.end()) << name;
    return it == variables_.end() ? 0xffffffff : it->second.reference;
  }
  template <class Function>
  Function function(const char* name) const {
    return fmu.function<Function>(name);
  }

  bool instantiate(const std::string& token, const std::string& resources, int type = fmi::kCoSimulation2) {
    said.clear();
    callbacks_ = {&log_2, std::calloc, std::free, nullptr, this};
    instance = is_2() ? function<fmi::Instantiate2>("Instantiate")("plant", type, token.c_str(), resources.c_str(),
                                                                   &callbacks_, 0, 0)
                      : function<fmi::Instantiate3>("InstantiateCoSimulation")(
                            "plant", token.c_str(), resources.c_str(), false, false, false, false, nullptr, 0, this,
                            &log_3, nullptr);
    return instance != nullptr;
  }
  bool instantiate() {
    return instantiate(fmu.model().token, (is_2() ? "file://" : "") + fmu.resources().string() + (is_2() ? "" : "/"));
  }
  void free() {
    if (instance) function<fmi::FreeInstance>("FreeInstance")(instance);
    instance = nullptr;
  }
  int enter(double start = 0) {
    if (!is_2())
      return function<fmi::EnterInitialization3>("EnterInitializationMode")(instance, false, 0, start, false, 0);
    const int status = function<fmi::SetupExperiment2>("SetupExperiment")(instance, 0, 0, start, 0, 0);
    return status != 0 ? status : plain("EnterInitializationMode");
  }
  /// A function of nothing but the instance.
  int plain(const char* name) { return function<fmi::Plain>(name)(instance); }
  int initialize(double start = 0) {
    const int status = enter(start);
    return status != 0 ? status : plain("ExitInitializationMode");
  }
  int set(const std::string& name, double value) {
    const fmi::Reference r = reference(name);
    return is_2() ? function<fmi::SetReal2>("SetReal")(instance, &r, 1, &value)
                  : function<fmi::SetFloat3>("SetFloat64")(instance, &r, 1, &value, 1);
  }
  int set_flag(const std::string& name, bool value) {
    const fmi::Reference r = reference(name);
    const fmi::Boolean2 whole = value ? 1 : 0;
    return is_2() ? function<fmi::SetBoolean2>("SetBoolean")(instance, &r, 1, &whole)
                  : function<fmi::SetBoolean3>("SetBoolean")(instance, &r, 1, &value, 1);
  }
  int try_get(const std::string& name, double& value) {
    const fmi::Reference r = reference(name);
    return is_2() ? function<fmi::GetReal2>("GetReal")(instance, &r, 1, &value)
                  : function<fmi::GetFloat3>("GetFloat64")(instance, &r, 1, &value, 1);
  }
  double get(const std::string& name) {
    double value = NAN;
    EXPECT_EQ(try_get(name, value), fmi::kOk) << name << ": " << said;
    return value;
  }
  std::vector<double> get_list(const std::string& name, int size) {
    std::vector<double> list;
    for (int k = 1; k <= size; ++k) list.push_back(get(name + "[" + std::to_string(k) + "]"));
    return list;
  }
  bool get_flag(const std::string& name) {
    const fmi::Reference r = reference(name);
    fmi::Boolean2 whole = -1;
    bool flag = false;
    const int status =
        is_2() ? function<int (*)(fmi::Instance, const fmi::Reference*, std::size_t, fmi::Boolean2*)>("GetBoolean")(
                     instance, &r, 1, &whole)
               : function<int (*)(fmi::Instance, const fmi::Reference*, std::size_t, bool*, std::size_t)>("GetBoolean")(
                     instance, &r, 1, &flag, 1);
    EXPECT_EQ(status, fmi::kOk) << name << ": " << said;
    return is_2() ? whole != 0 : flag;
  }
  int get_whole(const std::string& name) {
    const fmi::Reference r = reference(name);
    int whole = -1;
    const int status =
        is_2() ? function<int (*)(fmi::Instance, const fmi::Reference*, std::size_t, int*)>("GetInteger")(instance, &r,
                                                                                                          1, &whole)
               : function<int (*)(fmi::Instance, const fmi::Reference*, std::size_t, std::int32_t*, std::size_t)>(
                     "GetInt32")(instance, &r, 1, &whole, 1);
    EXPECT_EQ(status, fmi::kOk) << name << ": " << said;
    return whole;
  }
  /// Afterwards `terminates` tells whether the plant requests the end, `reached` the time reached.
  int step(double time, double size) {
    if (is_2()) {
      const int status = function<fmi::DoStep2>("DoStep")(instance, time, size, 1);
      fmi::Boolean2 over = 0;
      function<int (*)(fmi::Instance, int, fmi::Boolean2*)>("GetBooleanStatus")(instance, 3, &over);
      function<int (*)(fmi::Instance, int, double*)>("GetRealStatus")(instance, 2, &reached);
      terminates = over != 0;
      return status;
    }
    bool event = true, early = true;
    const int status =
        function<fmi::DoStep3>("DoStep")(instance, time, size, true, &event, &terminates, &early, &reached);
    EXPECT_FALSE(event);
    EXPECT_FALSE(early);
    return status;
  }

  fmi::Fmu fmu;
  fmi::Instance instance = nullptr;
  std::string said;  // what it logged last
  bool terminates = false;
  double reached = NAN;

 private:
  static void log_2(void* environment, const char*, int, const char*, const char* message, ...) {
    std::array<char, 4096> text{};
    std::va_list values;
    va_start(values, message);
    std::vsnprintf(text.data(), text.size(), message, values);
    va_end(values);
    static_cast<Master*>(environment)->said = text.data();
  }
  static void log_3(void* environment, int, const char*, const char* message) {
    static_cast<Master*>(environment)->said = message;
  }

  std::map<std::string, fmi::Variable> variables_;
  fmi::Callbacks2 callbacks_{};
};

/// Exports with the program.
class ExportFmu : public test::ProgramRun {
 protected:
  /// An FMU of version `fmi` in the test's folder.
  std::filesystem::path exported(const std::string& scenario, int fmi, const std::string& more = {}) const {
    const std::string name = "plant-" + std::to_string(fmi) + ".fmu";
    const test::Outcome done =
        run("export-fmu '" + scenario + "' --fmi " + std::to_string(fmi) + " -o " + name + " " + more);
    EXPECT_EQ(done.code, 0) << done.err;
    return folder_ / name;
  }
};

}  // namespace grapnel::testing
