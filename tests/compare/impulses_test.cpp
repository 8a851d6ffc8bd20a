// Impulses from logs: the estimator and its parts, on logs made from runs of the thesis's captures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "grapnel/campaign/run_scenario.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/compare/chi_square.hpp"
#include "grapnel/compare/impulse_estimate.hpp"
#include "grapnel/compare/local_fit.hpp"
#include "grapnel/compare/measured_impulses.hpp"
#include "grapnel/compare/step_detection.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace impulses_test {

using testing::AllOf;
using testing::HasSubstr;

// A run of a scenario, its results in a folder, and its series.
struct Recorded {
  ScratchFolder folder;
  CaptureResult result;
};

const Recorded& recorded(const std::string& scenario, const std::vector<Override>& more = {}) {
  static std::map<std::string, std::unique_ptr<Recorded>> all;
  std::unique_ptr<Recorded>& one = all[scenario + (more.empty() ? "" : more[0].value)];
  if (one) return *one;
  one = std::make_unique<Recorded>();
  std::vector<Override> changes{{"post_impact.duration", "5"}, {"output.interval", "0.02"}};
  changes.insert(changes.end(), more.begin(), more.end());
  const CaptureProblem problem =
      load_scenario(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios/thesis" / scenario, changes);
  one->result = simulate_capture(problem);
  write_results(
      problem, one->result, true,
      [&](const std::filesystem::path& file) {
        write_timeseries_hdf5(one->result.series, {"1.0", problem.name, problem.sha256}, file);
      },
      one->folder.path());
  return *one;
}

constexpr double kContact = 20;  // [s], of all these runs

// A log of a run at 100 Hz, from 4 s before the contact to 4 s after it.
struct Sensor {
  std::string series;
  double uncertainty;
  std::string frame = {};
  double bias = 0;
};

// `own_times`: at those of the run, 3 s on both sides, which are dense in a contact with a duration.
AlignedLog made_log(const Recorded& run, const std::vector<Sensor>& sensors, unsigned seed, double noise = 1,
                    bool own_times = false, double contact = kContact) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  AlignedLog log;
  log.head.run = {"synthetic", "abc"};
  log.head.log = {"log.csv", "def", "csv"};
  const TimeSeries& all = run.result.series;
  const auto series_of = [&](const std::string& path) -> const Series& {
    return *std::find_if(all.series.begin(), all.series.end(), [&](const Series& s) { return s.path == path; });
  };
  for (const Sensor& sensor : sensors) {
    const Series& series = series_of(sensor.series);
    const std::size_t width = series.components.size();
    std::vector<double> values = series.data;
    if (!sensor.frame.empty()) {
      const std::vector<double>& q = series_of(sensor.frame + "/quaternion_wxyz").data;
      for (std::size_t k = 0; k < all.time.size(); ++k) {
        const Rotationd R = rotation_matrix(Quaterniond{q[4 * k], q[4 * k + 1], q[4 * k + 2], q[4 * k + 3]});
        const Vector3d v = transposed_times(R, Vector3d{values[3 * k], values[3 * k + 1], values[3 * k + 2]});
        for (int c = 0; c < 3; ++c) values[3 * k + static_cast<std::size_t>(c)] = v[c];
      }
    }
    ComparedQuantity quantity{.name = sensor.series,
                              .run = sensor.series,
                              .unit = series.unit,
                              .components = series.components,
                              .columns = {"x"},
                              .time = {},
                              .measured = {},
                              .curve = RunCurve(all.time, values, width),
                              .is_orientation = series.path.ends_with("quaternion_wxyz"),
                              .uncertainty = sensor.uncertainty,
                              .bias_uncertainty = {}};
    quantity.series = sensor.series, quantity.frame = sensor.frame;
    if (quantity.is_orientation) quantity.components = {"x", "y", "z"};
    const double deviation = quantity.is_orientation ? sensor.uncertainty / 2 : sensor.uncertainty;  // of a quaternion
    std::vector<double> x(width);
    const auto add = [&](double t) {
      quantity.time.push_back(t);
      for (std::size_t c = 0; c < width; ++c)
        quantity.measured.push_back(x[c] + sensor.bias + noise * deviation * normal(random));
    };
    for (int i = -400; i < 400 && !own_times; ++i) {
      const double t = contact + 0.01 * i + 0.003;
      quantity.curve.value(t, x);
      add(t);
    }
    for (std::size_t k = 0; k < all.time.size() && own_times; ++k) {
      if (std::abs(all.time[k] - contact) > 3) continue;
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(k * width), width, x.begin());
      add(all.time[k]);
    }
    log.quantities.push_back(std::move(quantity));
  }
  return log;
}

std::vector<Sensor> all_sensors(const std::vector<std::string>& targets, double accuracy = 1) {
  std::vector<Sensor> sensors{{"base/angular_velocity", 2e-5, "base"},
                              {"base/velocity", 2e-5},
                              {"base/quaternion_wxyz", 1e-4},
                              {"base/position", 1e-3},
                              {"joints/position", 1e-4},
                              {"joints/velocity", 2e-4}};
  for (const std::string& target : targets) {
    sensors.push_back({"targets/" + target + "/angular_velocity", 2e-4});
    sensors.push_back({"targets/" + target + "/velocity", 2e-4});
  }
  for (Sensor& sensor : sensors) sensor.uncertainty *= accuracy;
  return sensors;
}

ImpulseOptions at_contact() {
  ImpulseOptions options;
  options.contacts = {{kContact, kContact, 0}};
  options.momentum = false;
  return options;
}

// Share of 500 draws in which each component is inside its 95 % interval, and the mean square of the deviations.
struct Coverage {
  std::string name;
  int inside = 0, draws = 0;
  double square = 0;
};
std::vector<Coverage> coverage(const Recorded& run, const std::vector<Sensor>& sensors) {
  const RunModel model(run.folder.path(), {}, {});
  std::vector<Coverage> all;
  for (unsigned draw = 0; draw < 500; ++draw) {
    ImpulseOptions options = at_contact();
    options.window = 1.0;
    const ImpulseReport report = measured_impulses(model, made_log(run, sensors, draw + 1), options).report;
    std::size_t k = 0;
    for (const ImpulseReport::Grasp& grasp : report.contacts[0].grasps) {
      for (const ImpulseReport::Component& c : grasp.components) {
        if (all.size() <= k) all.push_back({grasp.end_effector + " " + c.name});
        if (c.determined) {
          const double z = (*c.value - *c.simulated) / *c.uncertainty;
          all[k].inside += std::abs(z) < 1.96 ? 1 : 0, ++all[k].draws, all[k].square += z * z / 500;
        }
        ++k;
      }
    }
  }
  return all;
}

TEST(Impulses, TailsOfChiSquare) {
  EXPECT_NEAR(chi_square_tail(3.841458820694124, 1), 0.05, 1e-12);  // Abramowitz and Stegun, table 26.8
  EXPECT_NEAR(chi_square_tail(9.487729036781154, 4), 0.05, 1e-12);
  EXPECT_NEAR(chi_square_tail(24.99579013972863, 15), 0.05, 1e-12);
  EXPECT_NEAR(chi_square_quantile(1e-6, 6), 38.258, 1e-3);
}

TEST(Impulses, FitsOfPolynomialsAreExact) {
  SideTimes times;
  for (int k = 1; k <= 20; ++k) times.before.push_back(-0.03 * k), times.after.push_back(0.05 * k + 0.04);
  const double average = 0.04;
  // 1 + 2 t - 3 t^2 before, 4 - t + 0.5 t^2 after, averaged over the time before each sample.
  Eigen::VectorXd y(40);
  const auto mean = [&](double s, double a, double b, double c) {
    const double p = s - average;
    return a + b * (s + p) / 2 + c * (s * s + s * p + p * p) / 3;
  };
  for (int k = 0; k < 20; ++k) {
    y[k] = mean(times.before[static_cast<std::size_t>(k)], 1, 2, -3);
    y[20 + k] = mean(times.after[static_cast<std::size_t>(k)], 4, -1, 0.5);
  }
  const StepFit fit(times, 2, false, average);
  EXPECT_NEAR(fit.value_before().dot(y), 1, 1e-11);
  EXPECT_NEAR(fit.value_after().dot(y), 4, 1e-11);
  EXPECT_NEAR(fit.slope_before().dot(y), 2, 1e-11);
  EXPECT_NEAR(fit.slope_after().dot(y), -1, 1e-11);
  EXPECT_LT(fit.residual(y).norm(), 1e-12);
  Eigen::VectorXd kink(40);
  for (int k = 0; k < 20; ++k) {
    kink[k] = 3 + 2 * times.before[static_cast<std::size_t>(k)];
    kink[20 + k] = 3 - 5 * times.after[static_cast<std::size_t>(k)];
  }
  const StepFit continuous(times, 3, true, 0);
  EXPECT_NEAR(continuous.value_before().dot(kink), 3, 1e-11);
  EXPECT_NEAR(continuous.slope_after().dot(kink) - continuous.slope_before().dot(kink), -7, 1e-10);
}

TEST(Impulses, SmallNoiseGivesTheRunsImpulses) {
  const Recorded& run = recorded("open-loop-case-1.yaml");
  const RunModel model(run.folder.path(), {}, {});
  const AlignedLog log = made_log(run, all_sensors({"target-1", "target-2"}), 1, 1e-3);
  const ImpulseReport::Contact contact = measured_impulses(model, log, at_contact()).report.contacts[0];
  ASSERT_EQ(contact.grasps.size(), 2u);
  EXPECT_EQ(contact.rank, 12u);
  for (const ImpulseReport::Grasp& grasp : contact.grasps) {
    double linear = 0, angular = 0, linear_error = 0, angular_error = 0;
    for (std::size_t k = 0; k < 6; ++k) {
      const ImpulseReport::Component& c = grasp.components[k];
      ASSERT_TRUE(c.determined) << c.name;
      const double error = *c.value - *c.simulated;
      (k < 3 ? linear : angular) += *c.simulated * *c.simulated;
      (k < 3 ? linear_error : angular_error) += error * error;
    }
    EXPECT_GT(std::sqrt(linear), 0.05);
    EXPECT_LT(std::sqrt(linear_error / linear), 0.01) << grasp.end_effector;
    EXPECT_LT(std::sqrt(angular_error / angular), 0.01) << grasp.end_effector;
  }
}

TEST(Impulses, StatedIntervalsHoldInOpenLoop) {
  SKIP_UNDER_SANITIZERS();
  for (const Coverage& c : coverage(recorded("open-loop-case-1.yaml"), all_sensors({"target-1", "target-2"}))) {
    ASSERT_EQ(c.draws, 500) << c.name;
    EXPECT_GT(c.inside, 460) << c.name;  // 475 expected; three standard deviations of the count are 15
    EXPECT_GT(c.square, 0.5) << c.name;  // intervals are not too wide either
  }
}

// Bias and offset of the rates cancel; neither the base's translation nor the targets are measured.
TEST(Impulses, StatedIntervalsHoldWithFewBiasedSensors) {
  SKIP_UNDER_SANITIZERS();
  std::vector<Sensor> sensors{
      {"base/angular_velocity", 2e-5, "base", 1e-3}, {"joints/position", 1e-4}, {"joints/velocity", 2e-4, {}, 1e-3}};
  const Recorded& run = recorded("open-loop-case-1.yaml");
  int determined = 0;
  for (const Coverage& c : coverage(run, sensors)) {
    if (c.draws == 0) continue;
    ++determined;
    EXPECT_GT(c.inside, 460) << c.name;
  }
  EXPECT_GE(determined, 3);
}

TEST(Impulses, ClosedLoopsLeaveComponentsUndetermined) {
  const Recorded& run = recorded("closed-loop.yaml");
  const RunModel model(run.folder.path(), {}, {});
  const AlignedLog log = made_log(run, all_sensors({"sphere"}), 1);
  const ImpulseReport::Contact contact = measured_impulses(model, log, at_contact()).report.contacts[0];
  EXPECT_EQ(contact.unknowns, 12u);
  EXPECT_LT(contact.rank, contact.unknowns);
  EXPECT_EQ(contact.null_space.size(), contact.unknowns - contact.rank);
  EXPECT_EQ(contact.verdict, Verdict::yes) << contact.reason;
  int undetermined = 0, determined = 0;
  for (std::size_t g = 0; g < contact.grasps.size(); ++g) {
    for (std::size_t k = 0; k < 6; ++k) {
      const ImpulseReport::Component& c = contact.grasps[g].components[k];
      EXPECT_EQ(c.determined, c.value.has_value());
      EXPECT_EQ(c.determined, c.uncertainty.has_value());
      const bool in_run = run.result.impact()->grasps[g].determined[(k + 3) % 6];
      EXPECT_TRUE(c.determined || !in_run) << c.name;  // all rates are measured: the rest are self-stresses
      (c.determined ? determined : undetermined) += 1;
      if (c.determined) {
        EXPECT_LT(std::abs(*c.value - *c.simulated), 5 * *c.uncertainty) << c.name;
      }
    }
  }
  EXPECT_GT(determined, 0);
  EXPECT_GT(undetermined, 0);
}

TEST(Impulses, StatedIntervalsHoldInAClosedLoop) {
  SKIP_UNDER_SANITIZERS();
  int determined = 0;
  for (const Coverage& c : coverage(recorded("closed-loop.yaml"), all_sensors({"sphere"}))) {
    if (c.draws == 0) continue;
    ++determined;
    EXPECT_GT(c.inside, 460) << c.name;
  }
  EXPECT_GT(determined, 0);
}

TEST(Impulses, AWrongMassIsDetected) {
  SKIP_UNDER_SANITIZERS();
  const Recorded& run = recorded("open-loop-case-1.yaml");
  const std::vector<Override> heavier{{"targets.target-1.mass", "12"}};
  const RunModel right(run.folder.path(), {}, {}), wrong(run.folder.path(), {}, heavier);
  EXPECT_DOUBLE_EQ(wrong.problem().targets[0].mass, 12);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const AlignedLog log = made_log(run, all_sensors({"target-1", "target-2"}, 0.2), seed);
    const ImpulseReport::Contact a = measured_impulses(right, log, at_contact()).report.contacts[0];
    const ImpulseReport::Contact b = measured_impulses(wrong, log, at_contact()).report.contacts[0];
    EXPECT_EQ(a.verdict, Verdict::yes) << a.reason;
    EXPECT_EQ(b.verdict, Verdict::no) << b.reason;
    EXPECT_GT(*b.chi_square, 10 * *b.chi_square_bound);
  }
  // Six joint rates alone are fewer than the unknowns: nothing is redundant.
  const std::vector<Sensor> few{{"joints/velocity", 2e-4}};
  const ImpulseReport::Contact none = measured_impulses(right, made_log(run, few, 1), at_contact()).report.contacts[0];
  EXPECT_EQ(none.freedom, 0u);
  EXPECT_EQ(none.verdict, Verdict::not_checked);
  EXPECT_THAT(none.reason, HasSubstr("not checked"));
}

const Override kCompliantImpact{"impact",
                                "{law: compliant, grasp: {linear_stiffness: 2e6, linear_damping: 1e4, "
                                "angular_stiffness: 2e5, angular_damping: 900}}"};

// Forces of the grasps during a contact with a duration agree with the momentum balance and add to
// it.
TEST(Impulses, ForcesOfACompliantContact) {
  const Recorded& run = recorded("open-loop-case-1.yaml", {kCompliantImpact});
  const RunModel model(run.folder.path(), {}, {});
  ASSERT_EQ(model.contacts().size(), 1u);
  EXPECT_GT(model.contacts()[0].end, model.contacts()[0].time + 0.01);
  std::vector<Sensor> sensors = all_sensors({"target-1", "target-2"});
  const ImpulseReport::Contact without =
      measured_impulses(model, made_log(run, sensors, 1, 1, true), at_contact()).report.contacts[0];
  for (const char* tip : {"tip-1", "tip-2"}) {
    // Noise far below the error of sampling a short peak, which the run estimates.
    sensors.push_back({std::string("grasps/") + tip + "/force", 0.01});
    sensors.push_back({std::string("grasps/") + tip + "/moment", 0.01});
  }
  EXPECT_EQ(without.verdict, Verdict::yes) << without.reason;
  // Unmeasured efforts count as zero, and the report states it.
  EXPECT_EQ(without.zero_efforts.size(), 6u);
  EXPECT_THAT(without.zero_efforts, testing::Contains("arm-1-joint-2"));
  EXPECT_THAT(without.reason, AllOf(HasSubstr("the effort of arm-1-joint-1"), HasSubstr("counts as zero")));
  sensors.push_back({"joints/effort", 0.01});
  const ImpulseReport::Contact contact =
      measured_impulses(model, made_log(run, sensors, 1, 1, true), at_contact()).report.contacts[0];
  EXPECT_THAT(contact.zero_efforts, testing::IsEmpty());
  EXPECT_THAT(contact.reason, testing::Not(HasSubstr("counts as zero")));
  EXPECT_NEAR(contact.end, kContact + model.contacts()[0].end - model.contacts()[0].time, 1e-12);
  EXPECT_EQ(contact.rows, without.rows + 12);
  EXPECT_EQ(contact.verdict, Verdict::yes) << contact.reason;
  for (std::size_t g = 0; g < 2; ++g) {
    for (std::size_t k = 0; k < 6; ++k) {
      const ImpulseReport::Component& c = contact.grasps[g].components[k];
      EXPECT_LT(std::abs(*c.value - *c.simulated), 5 * *c.uncertainty) << c.name;
      EXPECT_LE(*c.uncertainty, 1.001 * *without.grasps[g].components[k].uncertainty) << c.name;
    }
  }
}

// A wrist sensor, in the end-effector's axes, gives what the force of the grasp in W gives.
TEST(Impulses, WristSensorsOfACompliantContact) {
  const Recorded& run = recorded("open-loop-case-1.yaml", {kCompliantImpact});
  const RunModel model(run.folder.path(), {}, {});
  const auto estimate = [&](bool in_own_axes) {
    std::vector<Sensor> sensors{{"base/angular_velocity", 2e-5}, {"joints/velocity", 2e-4}, {"joints/effort", 0.01}};
    for (const std::string tip : {"tip-1", "tip-2"}) {
      const std::string frame = in_own_axes ? "end_effectors/" + tip : "";
      sensors.push_back({"grasps/" + tip + "/force", 0.01, frame});
      sensors.push_back({"grasps/" + tip + "/moment", 0.01, frame});
    }
    return measured_impulses(model, made_log(run, sensors, 1, 1, true), at_contact()).report.contacts[0];
  };
  const ImpulseReport::Contact world = estimate(false), wrist = estimate(true);
  EXPECT_EQ(wrist.rows, world.rows);
  EXPECT_EQ(wrist.verdict, Verdict::yes) << wrist.reason;
  for (std::size_t g = 0; g < 2; ++g) {
    for (std::size_t k = 0; k < 6; ++k) {
      const ImpulseReport::Component& c = wrist.grasps[g].components[k];
      ASSERT_TRUE(c.value && c.simulated) << c.name;
      EXPECT_LT(std::abs(*c.value - *c.simulated), 5 * *c.uncertainty) << c.name;
      EXPECT_LT(*c.uncertainty, 20 * *world.grasps[g].components[k].uncertainty) << c.name;  // sampled along other axes
    }
    // Large enough to show wrong axes.
    EXPECT_GT(std::abs(*wrist.grasps[g].components[1].value), 50 * *wrist.grasps[g].components[1].uncertainty);
  }
}

TEST(Impulses, MomentumOfMeasuredMotion) {
  SKIP_UNDER_SANITIZERS();
  const Recorded& run = recorded("open-loop-case-1.yaml");
  const RunModel model(run.folder.path(), {}, {});
  ImpulseOptions options = at_contact();
  options.momentum = true;
  const AlignedLog log = made_log(run, all_sensors({"target-1", "target-2"}), 1);
  const MeasuredImpulses measured = measured_impulses(model, log, options);
  ASSERT_EQ(measured.momentum.size(), 3u);
  const TimeSeries& all = run.result.series;
  const auto curve = [&](const std::string& path) {
    const auto found =
        std::find_if(all.series.begin(), all.series.end(), [&](const Series& s) { return s.path == path; });
    return RunCurve(all.time, found->data, found->components.size());
  };
  const RunCurve linear = curve("robot/linear_momentum");
  double square = 0, largest = 0;
  const MomentumCurve& robot = measured.momentum[0];
  ASSERT_GT(robot.time.size(), 700u);
  std::vector<double> p(3);
  for (std::size_t k = 0; k < robot.time.size(); ++k) {
    linear.value(robot.time[k], p);
    for (std::size_t c = 0; c < 2; ++c) {
      const double z = (robot.value[k][c] - p[c]) / robot.deviation[k][c];
      square += z * z / (2 * static_cast<double>(robot.time.size())), largest = std::max(largest, std::abs(p[c]));
    }
    EXPECT_TRUE(std::isfinite(robot.value[k][5]) && std::isfinite(robot.value[k][8]) &&
                std::isfinite(robot.value[k][9]));
  }
  EXPECT_GT(largest, 0.01);  // [N s]
  EXPECT_GT(square, 0.5);    // stated uncertainties describe the errors
  EXPECT_LT(square, 2);
  // Without the base's velocity only the angular momentum about the centre of mass is determined.
  std::vector<Sensor> sensors{
      {"base/angular_velocity", 2e-5, "base"}, {"joints/position", 1e-4}, {"joints/velocity", 2e-4}};
  const MomentumCurve few = measured_impulses(model, made_log(run, sensors, 1), options).momentum[0];
  EXPECT_TRUE(std::isnan(few.value[10][0]) && std::isnan(few.value[10][8]) && std::isnan(few.value[10][9]));
  EXPECT_NEAR(few.value[10][5], robot.value[10][5], 8 * robot.deviation[10][5]);
  EXPECT_THAT(few.missing, testing::Contains("base/velocity"));
}

// The first curve is that of a target: the base is fixed and has no momentum.
TEST(Impulses, MomentumAboutTheOriginNeedsThePositionOfTheTarget) {
  SKIP_UNDER_SANITIZERS();
  constexpr double kStop = 2;  // [s]
  const Recorded& run = recorded("../dual-panda-capture.yaml", {{"post_impact.duration", "0.5"}});
  const RunModel model(run.folder.path(), {}, {});
  std::vector<Sensor> sensors{{"targets/box/angular_velocity", 1e-4},
                              {"targets/box/velocity", 1e-4},
                              {"targets/box/quaternion_wxyz", 1e-4},
                              {"joints/velocity", 1e-4}};
  ImpulseOptions options;
  options.contacts = {{kStop, kStop, 0}};
  const MomentumCurve without =
      measured_impulses(model, made_log(run, sensors, 1, 1, false, kStop), options).momentum.at(0);
  EXPECT_EQ(without.body, "box");
  EXPECT_THAT(without.missing, testing::ElementsAre("targets/box/position"));
  ASSERT_GT(without.time.size(), 100u);
  EXPECT_NEAR(without.value[10][0], 4.2 * -0.25, 1e-2);  // [N s], in x
  for (std::size_t c = 6; c < 9; ++c) EXPECT_TRUE(std::isnan(without.value[10][c]));
  sensors.push_back({"targets/box/position", 1e-4});
  const MomentumCurve with =
      measured_impulses(model, made_log(run, sensors, 1, 1, false, kStop), options).momentum.at(0);
  EXPECT_NEAR(with.value[10][7], 0.45 * 4.2 * -0.25, 1e-2);  // [N m s], about y: z p_x
}

TEST(Impulses, HeldDrivesHaveTheUnitOfTheirJoint) {
  constexpr double kGrasp = 0.5;  // [s]; the run grasps at its beginning, without samples before
  const Recorded& run =
      recorded("../air-bearing-friction.yaml", {{"impact.joints", "driven"}, {"post_impact.duration", "1"}});
  const RunModel model(run.folder.path(), {}, {});
  ImpulseOptions options;
  options.contacts = {{kGrasp, kGrasp, 0}}, options.momentum = false;
  const ImpulseReport report =
      measured_impulses(model, made_log(run, {{"joints/velocity", 1e-4}}, 1, 1, false, kGrasp), options).report;
  std::map<std::string, std::string> units;
  for (const ImpulseReport::Component& drive : report.contacts.at(0).drives) units[drive.name] = drive.unit;
  EXPECT_EQ(units["table-x"], "N s");
  EXPECT_EQ(units["elbow"], "N m s");
}

// With position and orientation of a frame beside the body's origin, an error of the orientation turns the body about
// this frame.
TEST(Impulses, OrientationsTurnBodiesAboutTheirMeasuredPoint) {
  const Recorded& run = recorded("open-loop-case-1.yaml");
  const RunModel model(run.folder.path(), {}, {});
  const AlignedLog log = made_log(run, {{"base/position", 1e-3}, {"base/quaternion_wxyz", 1e-2}}, 1, 0);
  const Posed X_BF{rotation_about(Vector3d{0, 0, 1}, 0.3), {0.4, -0.2, 0.7}};
  MeasuredQuantity position;
  position.quantity = &log.quantities[0], position.kind = MeasuredQuantity::Kind::position;
  position.place = {model.system().base, X_BF}, position.parts = {0, 1, 2};
  MeasuredQuantity orientation;
  orientation.quantity = &log.quantities[1], orientation.kind = MeasuredQuantity::Kind::orientation;
  orientation.place = {model.system().base, X_BF}, orientation.parts = {0, 1, 2};
  const Eigen::Vector3d place(1, 2, 3), turn(0.1, 0.2, -0.3);
  for (const bool position_first : {true, false}) {
    MeasuredConfiguration configuration(model, model.state_at(kContact));
    const auto set_position = [&] {
      configuration.set(position, place, Eigen::Vector3d::Constant(1e-3), Quaterniond::identity());
    };
    if (position_first) set_position();
    configuration.set(orientation, turn, Eigen::Vector3d::Constant(1e-2), Quaterniond::identity());
    if (!position_first) set_position();
    ASSERT_EQ(configuration.parameters(), 6u);
    for (std::size_t k = 0; k < 6; ++k) {
      std::vector<double> changes(6, 0.0);
      const Posed before = root_pose(model.model(), configuration.at(changes), model.system().base);
      changes[k] = 1;
      const Posed after = root_pose(model.model(), configuration.at(changes), model.system().base);
      const Vector3d p = (before * X_BF).p, moved = (after * X_BF).p - p;
      EXPECT_LT(norm(p - Vector3d{1, 2, 3}), 1e-12);
      const bool is_turn = (k >= 3) == position_first;
      EXPECT_NEAR(norm(moved), is_turn ? 0 : 1e-3, 1e-12) << k;
      if (is_turn) {
        EXPECT_GT(norm(after.p - before.p), 3e-3) << k;  // [m]; 1e-2 rad at a distance
      }
    }
  }
}

TEST(Impulses, FalseAlarmsAreAsRareAsStated) {
  SKIP_UNDER_SANITIZERS();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int alarms = 0;
  constexpr int kLogs = 2000;
  const StepTest test{0.16, 0.1, 0};
  for (int log = 0; log < kLogs; ++log) {
    std::vector<RateSamples> rates(6);
    for (RateSamples& rate : rates) {
      rate.deviation = 0.01;
      for (int k = 0; k < 250; ++k)
        rate.time.push_back(0.01 * k), rate.value.push_back(0.3 - 0.2 * 0.01 * k + 0.01 * normal(random));
    }
    alarms += detect_steps(rates, test).empty() ? 0 : 1;
  }
  EXPECT_LT(alarms, 240);  // 0.1 of 2000 are 200, three standard deviations 40
  EXPECT_GT(alarms, 20);   // the bound is not idle
}

// Three rates with jumps, which take `duration`.
struct Jump {
  double time, size, duration = 0;
};
std::vector<DetectedStep> steps_of(const std::vector<Jump>& jumps, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<RateSamples> rates(3);
  for (RateSamples& rate : rates) {
    rate.deviation = 0.01;
    for (int k = 0; k < 300; ++k) {
      const double t = 0.01 * k;
      double value = 0.3 - 0.2 * t + 0.01 * normal(random);
      for (const Jump& one : jumps)
        value += one.size * (one.duration > 0 ? std::clamp((t - one.time) / one.duration, 0.0, 1.0) : t >= one.time);
      rate.time.push_back(t), rate.value.push_back(value);
    }
  }
  return detect_steps(rates, {0.2, 0.01, 0});
}

TEST(Impulses, DetectsWeakContactsBesideStrongOnes) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const double weak : {1.195, 1.795}) {  // 1.5 windows before and after the strong one
      const std::vector<DetectedStep> steps = steps_of({{1.495, 2}, {weak, 0.1}}, seed);
      ASSERT_EQ(steps.size(), 2u) << seed << " " << weak;
      EXPECT_LT(steps[0].time, steps[1].time);
      const DetectedStep &of_weak = steps[weak < 1.495 ? 0 : 1], &of_strong = steps[weak < 1.495 ? 1 : 0];
      EXPECT_NEAR(of_weak.time, weak, 0.02);
      EXPECT_LT(of_weak.deviation, 0.02);
      EXPECT_NEAR(of_strong.time, 1.495, 0.005);
      EXPECT_GT(of_strong.statistic, 10 * of_weak.statistic);
    }
    // A contact that takes time is one contact, although the statistic exceeds the threshold beyond one window.
    const std::vector<DetectedStep> slow = steps_of({{1.4, 2, 0.08}}, seed);
    ASSERT_EQ(slow.size(), 1u) << seed;
    EXPECT_NEAR(slow[0].time, 1.44, 0.04);
  }
}

TEST(Impulses, DetectsTheContact) {
  const Recorded& run = recorded("open-loop-case-1.yaml");
  const RunModel model(run.folder.path(), {}, {});
  ImpulseOptions options;
  options.momentum = false;
  constexpr unsigned kSeeds = test::repetitions(20);
  unsigned near = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const AlignedLog log = made_log(run, all_sensors({"target-1", "target-2"}), seed);
    const ImpulseReport report = measured_impulses(model, log, options).report;
    ASSERT_EQ(report.contacts.size(), 1u);
    const ImpulseReport::Contact& contact = report.contacts[0];
    EXPECT_TRUE(contact.detected);
    EXPECT_LT(std::abs(contact.time - kContact), 0.02);
    near += std::abs(contact.time - kContact) < 2 * *contact.time_uncertainty ? 1 : 0;
    EXPECT_EQ(contact.verdict, Verdict::yes) << contact.reason;
    EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
  }
  EXPECT_GT(near, kSeeds * 7 / 10);
}

TEST(Impulses, ErrorsNameWhatIsMissing) {
  const Recorded& run = recorded("open-loop-case-1.yaml");
  const RunModel model(run.folder.path(), {}, {});
  const auto error_of = [&](AlignedLog log, const ImpulseOptions& options) -> std::string {
    try {
      measured_impulses(model, log, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  AlignedLog log = made_log(run, {{"joints/velocity", 2e-4}}, 1);
  log.quantities[0].uncertainty.reset();
  EXPECT_THAT(
      error_of(log, at_contact()),
      AllOf(HasSubstr("no quantity of the mapping measures a rate: needed are series such as base/angular_velocity"),
            HasSubstr("joints/velocity: not used without an uncertainty")));
  EXPECT_THAT(error_of(made_log(run, {{"joints/position", 1e-4}}, 1), {}), HasSubstr("state them with --at"));
  ImpulseOptions late = at_contact();
  late.contacts = {{23.99, 23.99, 0}};
  EXPECT_THAT(error_of(made_log(run, {{"joints/velocity", 2e-4}}, 1), late),
              HasSubstr("no rate has enough samples on both sides of the contact at t = 23.99 s: at least 5"));
  late.contacts = {{20, 20, 0}, {20, 20, 0}, {200, 200, 0}};
  EXPECT_THAT(
      error_of(made_log(run, {{"joints/velocity", 2e-4}}, 1), late),
      AllOf(HasSubstr("the contacts stated at t = 20 s and 20 s coincide or overlap"),
            HasSubstr("the contact stated from t = 200 to 200 s is not within the samples, which are from 16.003 to")));
  const ScratchFolder empty;
  try {
    RunModel(empty.path(), {}, {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("scenario.json"), HasSubstr("state its file with --scenario")));
  }
}

}  // namespace impulses_test
}  // namespace grapnel
