/// What an exported plant, and the command that exports it, refuse.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "fmu/master.hpp"

namespace grapnel::testing {
namespace plant_errors_test {

class PlantErrors : public ExportFmu {
 protected:
  void SetUp() override {
    ExportFmu::SetUp();
    write("robot.yaml", kShortRobot);
    scenario_ = write("short.yaml", kShortCapture).string();
  }
  std::string scenario_;
};

void expect_has(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST_F(PlantErrors, CallsInAnIllegalOrder) {
  for (const int version : {2, 3}) {
    const std::string prefix = "fmi" + std::to_string(version);
    Master plant(exported(scenario_, version));
    ASSERT_TRUE(plant.instantiate()) << plant.said;
    double value = 0;
    // Before initialization.
    EXPECT_EQ(plant.try_get("joint.elbow.rate", value), fmi::kError);
    expect_has(plant.said, prefix + (version == 2 ? "GetReal" : "GetFloat64") +
                               ": joint.elbow.rate is available only from initialization mode on");
    EXPECT_EQ(plant.step(0, 0.01), fmi::kError);
    expect_has(plant.said, "must not be called before initialization mode");
    EXPECT_EQ(plant.plain("ExitInitializationMode"), fmi::kError);
    EXPECT_EQ(plant.plain("Terminate"), fmi::kError);
    if (version == 2) {
      EXPECT_EQ(plant.plain("EnterInitializationMode"), fmi::kError);
      expect_has(plant.said, "fmi2SetupExperiment must be called first");
    }
    // What was refused has changed nothing.
    ASSERT_EQ(plant.enter(), fmi::kOk) << plant.said;
    EXPECT_EQ(plant.step(0, 0.01), fmi::kError);
    expect_has(plant.said, "in initialization mode");
    EXPECT_NE(plant.enter(), fmi::kOk);
    ASSERT_EQ(plant.plain("ExitInitializationMode"), fmi::kOk) << plant.said;
    ASSERT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
    // Variables.
    EXPECT_EQ(plant.set("joint.elbow.rate", 1), fmi::kError);
    expect_has(plant.said, "joint.elbow.rate is an output and cannot be set");
    EXPECT_EQ(plant.set("targets[0].mass", 1), fmi::kError);
    expect_has(plant.said, "targets[0].mass is a fixed parameter, which can be set before the run only");
    EXPECT_EQ(plant.set("joint.elbow.effort", NAN), fmi::kError);
    expect_has(plant.said, "joint.elbow.effort is set to nan, must be finite");
    EXPECT_EQ(plant.set_flag("joint.elbow.effort", true), fmi::kError);
    expect_has(plant.said, "joint.elbow.effort is a real number, not a truth value");
    const fmi::Reference none = 4000;
    EXPECT_EQ(version == 2 ? plant.function<fmi::SetReal2>("SetReal")(plant.instance, &none, 1, &value)
                           : plant.function<fmi::SetFloat3>("SetFloat64")(plant.instance, &none, 1, &value, 1),
              fmi::kError);
    expect_has(plant.said, "no variable has the value reference 4000");
    if (version == 3) {
      const fmi::Reference first = 1;
      EXPECT_EQ(plant.function<fmi::GetFloat3>("GetFloat64")(plant.instance, &first, 1, &value, 2), fmi::kError);
      expect_has(plant.said, "the numbers of values and value references must be equal");
    }
    // Arrays that are missing.
    const fmi::Reference first_one = 1;
    if (version == 2) {
      EXPECT_EQ(plant.function<fmi::GetReal2>("GetReal")(plant.instance, nullptr, 1, &value), fmi::kError);
      expect_has(plant.said, "fmi2GetReal: an array is a null pointer");
      EXPECT_EQ(plant.function<fmi::GetReal2>("GetReal")(plant.instance, &first_one, 1, nullptr), fmi::kError);
      EXPECT_EQ(plant.function<fmi::SetReal2>("SetReal")(plant.instance, &first_one, 1, nullptr), fmi::kError);
      EXPECT_EQ(plant.function<fmi::SetBoolean2>("SetBoolean")(plant.instance, nullptr, 1, nullptr), fmi::kError);
      EXPECT_EQ(plant.function<fmi::GetReal2>("GetReal")(plant.instance, nullptr, 0, nullptr), fmi::kOk);
      using Ask = int (*)(fmi::Instance, int, double*);
      EXPECT_EQ(plant.function<Ask>("GetRealStatus")(plant.instance, 2, nullptr), fmi::kError);
    } else {
      EXPECT_EQ(plant.function<fmi::GetFloat3>("GetFloat64")(plant.instance, nullptr, 1, &value, 1), fmi::kError);
      expect_has(plant.said, "fmi3GetFloat64: an array is a null pointer");
      EXPECT_EQ(plant.function<fmi::GetFloat3>("GetFloat64")(plant.instance, &first_one, 1, nullptr, 1), fmi::kError);
      EXPECT_EQ(plant.function<fmi::SetFloat3>("SetFloat64")(plant.instance, nullptr, 1, nullptr, 1), fmi::kError);
      EXPECT_EQ(plant.function<fmi::GetFloat3>("GetFloat64")(plant.instance, nullptr, 0, nullptr, 0), fmi::kOk);
    }
    // Steps.
    EXPECT_EQ(plant.step(0.05, 0.01), fmi::kError);
    expect_has(plant.said, "the communication point is 0.05 [s], expected 0.01");
    for (const double size : {0.0, -0.01, 0.015, 1e-5, static_cast<double>(NAN)}) {
      // Of FMI 2.0 discard would mean that a part of the step was computed.
      EXPECT_EQ(plant.step(0.01, size), version == 2 ? fmi::kError : fmi::kDiscard) << size;
      expect_has(plant.said, "must be a multiple of the control period, 0.01");
      EXPECT_FALSE(plant.terminates);
    }
    ASSERT_EQ(plant.step(0.01, 0.01), fmi::kOk) << plant.said;
    // What there is none of.
    void* state = nullptr;
    EXPECT_EQ(plant.function<int (*)(fmi::Instance, void**)>(version == 2 ? "GetFMUstate" : "GetFMUState")(
                  plant.instance, &state),
              fmi::kError);
    expect_has(plant.said, "canGetAndSetFMU");
    // After termination.
    ASSERT_EQ(plant.plain("Terminate"), fmi::kOk);
    EXPECT_EQ(plant.step(0.02, 0.01), fmi::kError);
    expect_has(plant.said, "after termination");
    EXPECT_EQ(plant.set("joint.elbow.effort", 1), fmi::kError);
    EXPECT_NE(plant.plain("Terminate"), fmi::kOk);
    ASSERT_EQ(plant.plain("Reset"), fmi::kOk);
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
    ASSERT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
  }
}

TEST_F(PlantErrors, InvalidInstances) {
  for (const int version : {2, 3}) {
    Master plant(exported(scenario_, version));
    const std::string uri = version == 2 ? "file://" : "", resources = plant.fmu.resources().string();
    EXPECT_FALSE(plant.instantiate("{another}", uri + resources));
    expect_has(plant.said, "the token {another} is not that of the model in");
    EXPECT_FALSE(plant.instantiate(plant.fmu.model().token, uri + "/nowhere"));
    expect_has(plant.said, "there is no file plant.json in the FMU's resources, /nowhere");
    EXPECT_FALSE(plant.instantiate(plant.fmu.model().token, ""));
    expect_has(plant.said, "the resource location is missing");
    EXPECT_FALSE(plant.instantiate(plant.fmu.model().token, "file://elsewhere.example/x"));
    expect_has(plant.said, "is not on this machine");
    if (version == 2) {
      EXPECT_FALSE(plant.instantiate(plant.fmu.model().token, uri + resources, 0));
      expect_has(plant.said, "for co-simulation only");
      EXPECT_TRUE(plant.instantiate(plant.fmu.model().token, "file:" + resources)) << plant.said;
    } else {
      EXPECT_EQ(plant.function<fmi::Instance (*)(const char*, const char*, const char*, bool, bool, void*, void*)>(
                    "InstantiateModelExchange")("x", "", "", false, false, nullptr, nullptr),
                nullptr);
      EXPECT_EQ(plant.plain("EnterEventMode"), fmi::kError);  // without an instance
    }
  }
}

// Of a scenario that has been damaged, and of parameters that it does not take.
TEST_F(PlantErrors, UnusableScenarios) {
  for (const int version : {2, 3}) {
    Master plant(exported(scenario_, version, "--parameter targets[0].mass"));
    EXPECT_EQ(plant.variables().count("initial.joints[1]"), 0u);
    ASSERT_TRUE(plant.instantiate()) << plant.said;
    ASSERT_EQ(plant.set("targets[0].mass", -3), fmi::kOk);
    ASSERT_EQ(plant.enter(), fmi::kOk);
    EXPECT_EQ(plant.plain("ExitInitializationMode"), fmi::kError);
    expect_has(plant.said, "the scenario in the FMU's resources cannot be used; --set targets[0].mass=-3");
    // Nothing is left but to get, reset and free.
    EXPECT_EQ(plant.step(0, 0.01), fmi::kError);
    expect_has(plant.said, "after an error; only reset and free are allowed");
    ASSERT_EQ(plant.plain("Reset"), fmi::kOk);
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
    plant.free();
    const std::filesystem::path file = plant.fmu.resources() / "scenario" / "short.yaml";
    std::ofstream(file, std::ios::app) << "aproach: {}\n";
    EXPECT_FALSE(plant.instantiate());
    expect_has(plant.said, "the scenario in the FMU's resources cannot be used; ");
    expect_has(plant.said, "'aproach'");
    std::ofstream(plant.fmu.resources() / "plant.json") << "{\"format\": 1";
    EXPECT_FALSE(plant.instantiate());
    expect_has(plant.said, "plant.json is damaged");
  }
}

// A failed run reports its error permanently; the last readings remain available.
TEST_F(PlantErrors, FailedRuns) {
  const std::string unlimited =
      "--set 'robot.links[1].joint={name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [0.8, 0, 0]}}'";
  for (const int version : {2, 3}) {
    Master plant(exported(scenario_, version, unlimited));
    ASSERT_TRUE(plant.instantiate()) << plant.said;
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
    ASSERT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
    const double before = plant.get("joint.elbow.position");
    ASSERT_EQ(plant.set("joint.elbow.effort", 1e6), fmi::kOk);
    EXPECT_EQ(plant.step(0.01, 0.01), fmi::kError);
    expect_has(plant.said, "DoStep: ");
    expect_has(plant.said, "sampled control is unstable: at t = 0.02 s");
    EXPECT_FALSE(plant.terminates);
    EXPECT_EQ(plant.get("joint.elbow.position"), before);
    EXPECT_EQ(plant.step(0.01, 0.01), fmi::kError);
    expect_has(plant.said, "after an error; only reset and free are allowed");
    ASSERT_EQ(plant.plain("Reset"), fmi::kOk);
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
    EXPECT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
  }
}

TEST_F(PlantErrors, UnsupportedExports) {
  const auto refused = [&](const std::string& more, const std::string& what, int code = 2) {
    const test::Outcome done = run("export-fmu short.yaml -o x.fmu " + more);
    EXPECT_EQ(done.code, code) << more;
    expect_has(done.err, what);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "x.fmu"));
  };
  refused("--set 'approach.duration=-1'", "approach.duration");
  refused("--parameter targets[0].name", "--parameter targets[0].name: not a number");
  refused("--parameter targets[0].density", "the scenario has no such value; set one with --set");
  refused("--fmi 1", "--fmi");
  refused("--set 'control={period: 0.01, torques: efforts.csv}'", "efforts.csv");
  write("efforts.csv", "time,shoulder,elbow\n0,0,0\n1,0,0\n");
  refused("--set 'control={period: 0.01, torques: efforts.csv}' --set approach.tracking.mode=controller",
          "control.torques conflicts with the external control of an exported plant");
  // As the message says.
  EXPECT_EQ(run("export-fmu short.yaml -o y.fmu --set 'control={period: 0.01, external: true}' --set "
                "approach.tracking.mode=controller --set post_impact.joints=controller")
                .code,
            0);
  refused("--set robot=" + (folder_ / "robot.yaml").string(), "is named by an absolute path");
  write("no-control.yaml", std::string(kShortCapture).substr(0, std::string(kShortCapture).find("control:")));
  // A period is assumed, and said.
  const test::Outcome done = run("export-fmu no-control.yaml -o z.fmu");
  EXPECT_EQ(done.code, 0) << done.err;
  expect_has(done.out, "The scenario has no control.period: control.period=10 ms is taken");
  Master plant(folder_ / "z.fmu");
  ASSERT_TRUE(plant.instantiate()) << plant.said;
  ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
  EXPECT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
  const test::Outcome nowhere = run("export-fmu short.yaml -o nowhere/x.fmu");
  EXPECT_EQ(nowhere.code, 1);
  expect_has(nowhere.err, "nowhere/x.fmu");
}

// By default a parameter is every number of the scenario, whatever unit it is written with.
TEST_F(PlantErrors, ParametersWithUnits) {
  std::string text = kShortCapture;
  const std::string plain = "mass: 10";
  ASSERT_NE(text.find(plain), std::string::npos) << text;
  text.replace(text.find(plain), plain.size(), "mass: 10000 g");
  text.replace(text.find("[0, 0, 0.2]"), 11, "[0, 0, 0.2 rad/s]");
  write("units.yaml", text);
  Master plant(exported("units.yaml", 2)), same(exported("short.yaml", 2));
  ASSERT_TRUE(plant.variables().contains("targets[0].mass"));
  ASSERT_TRUE(plant.variables().contains("targets[0].state.angular_velocity[2]"));
  EXPECT_EQ(plant.variables().size(), same.variables().size());
  ASSERT_TRUE(plant.instantiate()) << plant.said;
  EXPECT_EQ(plant.get("targets[0].mass"), 10);
  ASSERT_EQ(plant.set("targets[0].mass", 12), fmi::kOk);
  ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
  EXPECT_EQ(plant.get("targets[0].mass"), 12);
  EXPECT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
}

// It carries all that it needs: files keep their places, and the folder that they came from may be gone.
TEST_F(PlantErrors, IndependentOfBuildMachine) {
  std::filesystem::create_directories(folder_ / "a" / "scenarios");
  std::filesystem::create_directories(folder_ / "a" / "robots");
  std::filesystem::rename(folder_ / "robot.yaml", folder_ / "a" / "robots" / "robot.yaml");
  std::filesystem::rename(folder_ / "short.yaml", folder_ / "a" / "scenarios" / "short.yaml");
  const std::filesystem::path file =
      exported("a/scenarios/short.yaml", 2, "--set robot=../robots/robot.yaml --set robot.base.mass=60");
  std::filesystem::remove_all(folder_ / "a");
  Master plant(file);
  EXPECT_TRUE(std::filesystem::exists(plant.fmu.resources() / "scenario" / "robots" / "robot.yaml"));
  ASSERT_TRUE(plant.instantiate()) << plant.said;
  ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.said;
  ASSERT_EQ(plant.step(0, 0.01), fmi::kOk) << plant.said;
  // Of its libraries only those of every system are searched outside.
  for (const auto& entry :
       std::filesystem::directory_iterator(plant.fmu.resources().parent_path() / "binaries" / "linux64")) {
    const std::string name = entry.path().filename().string();
    EXPECT_EQ(name.find("hdf5"), std::string::npos) << name;
    EXPECT_EQ(name.find("crypto"), std::string::npos) << name;
  }
}

}  // namespace plant_errors_test
}  // namespace grapnel::testing
