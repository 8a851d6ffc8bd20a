// Logs in tables, mappings with frames and units, and the messages of damaged logs and wrong mappings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "grapnel/compare/compare_log.hpp"
#include "grapnel/compare/log_folder.hpp"
#include "grapnel/compare/measured_log.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/series_export.hpp"
#include "grapnel/spatial/pose.hpp"

namespace grapnel {
namespace compare_files_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// A base that turns about z; a position and a rate in W; a scalar.
TimeSeries run_series() {
  TimeSeries run;
  run.phases = {"approach"};
  run.series = {{"base/angular_velocity", "rad/s", "", {"x", "y", "z"}, {}},
                {"base/position", "m", "", {"x", "y", "z"}, {}},
                {"base/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}},
                {"kinetic_energy", "J", "", {""}, {}}};
  for (int k = 0; k <= 1000; ++k) {
    const double t = 0.02 * k, angle = 0.3 * t + 0.2 * std::sin(t);
    run.time.push_back(t), run.phase.push_back(0);
    const auto add = [&](std::size_t i, std::vector<double> x) {
      run.series[i].data.insert(run.series[i].data.end(), x.begin(), x.end());
    };
    add(0, {0.02 * std::sin(t), 0.01 * std::cos(2 * t), 0.3 + 0.2 * std::cos(t)});
    add(1, {1 + 0.1 * std::sin(t), 2 - 0.05 * t, 0.2 * std::cos(0.7 * t)});
    add(2, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)});
    add(3, {5 + std::sin(t)});
  }
  return run;
}

class CompareFiles : public testing::Test {
 protected:
  void SetUp() override {
    write_timeseries_hdf5(run_series(), {"1.0", "synthetic", "abc"}, folder_.path() / "timeseries.h5");
  }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return folder_.path() / name;
  }
  // All messages of a comparison, without the folder.
  std::string errors(const std::string& log, const std::string& mapping) const {
    const std::filesystem::path map = mapping.empty() ? std::filesystem::path() : write("map.yaml", mapping);
    try {
      compare_log(folder_.path(), write("log.csv", log), map);
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string prefix = folder_.path().string() + "/";
      for (std::size_t at; (at = text.find(prefix)) != std::string::npos;) text.erase(at, prefix.size());
      return text;
    }
    return "";
  }

  ScratchFolder folder_;
};

TEST_F(CompareFiles, TheRunsOwnExportsAgreeInAllFormats) {
  const std::filesystem::path csv = folder_.path() / "log.csv", mat = folder_.path() / "log.mat";
  write_timeseries_csv(run_series(), csv);
  write_timeseries_mat(run_series(), {"1.0", "synthetic", "abc"}, mat);
  for (const std::filesystem::path& log : {csv, mat, folder_.path() / "timeseries.h5"}) {
    const LogComparison comparison = compare_log(folder_.path(), log, {});
    ASSERT_EQ(comparison.report.quantities.size(), 4u) << log;
    for (const ComparisonReport::Quantity& one : comparison.report.quantities) {
      EXPECT_EQ(one.compared, 1001u) << log << one.name;
      EXPECT_LT(*one.rms, 1e-12) << log << one.name;
      EXPECT_EQ(one.interpolation_error, 0.0) << log << one.name;  // all times are those of samples
    }
    EXPECT_THAT(comparison.report.warnings, testing::IsEmpty()) << log;
    EXPECT_EQ(comparison.report.verdict, Verdict::not_checked);
  }
}

TEST_F(CompareFiles, AStopLeavesTheFolderUnchanged) {
  const std::filesystem::path csv = folder_.path() / "log.csv";
  write_timeseries_csv(run_series(), csv);
  std::stop_source stop;
  LogFolderOptions options;
  options.folder = folder_.path() / "results", options.no_report = true, options.stop = stop.get_token();
  Listener listener;
  EXPECT_EQ(run_comparison_folder({folder_.path(), csv, {}}, options, listener), Ending::done);
  std::filesystem::remove(options.folder / "comparison.csv");
  stop.request_stop();
  EXPECT_EQ(run_comparison_folder({folder_.path(), csv, {}}, options, listener), Ending::interrupted);
  EXPECT_FALSE(std::filesystem::exists(options.folder / "comparison.csv"));
}

TEST_F(CompareFiles, DriftOfTheClock) {
  std::string log = "stamp,w\n";
  const TimeSeries run = run_series();
  for (std::size_t k = 50; k < 950; ++k) {
    std::ostringstream line;
    line.precision(17);
    line << 1e6 + (run.time[k] - run.time[50]) * (1 - 5e-5) << ',' << run.series[0].data[3 * k + 2] << "\n";
    log += line.str();
  }
  const auto compare = [&](const std::string& time) {
    const std::string mapping = "time: {column: stamp, " + time +
                                "}\nquantities: [{run: base/angular_velocity/z, log: w, uncertainty: 1e-6}]\n";
    return compare_log(folder_.path(), write("log.csv", log), write("map.yaml", mapping)).report;
  };
  const ComparisonReport found = compare("offset: found, drift: found");
  EXPECT_TRUE(found.clock.drift_found);
  EXPECT_NEAR(found.clock.drift, 5e-5, 2e-7);
  EXPECT_NEAR(found.clock.offset, run.time[50] - 1e6, 1e-6);
  EXPECT_EQ(found.clock.reference, 1e6);
  EXPECT_EQ(found.verdict, Verdict::yes);
  EXPECT_THAT(comparison_report_text(found),
              testing::ContainsRegex("drift: (49.9|50)[0-9.]* ppm after log time 1000000 s"));
  EXPECT_EQ(compare("offset: -999999, drift: 5e-5").verdict, Verdict::yes);
  EXPECT_EQ(compare("offset: -999999, drift: 5e-5, reference: 999900").verdict, Verdict::no);
  EXPECT_EQ(compare("offset: found").verdict, Verdict::no);
  EXPECT_THAT(
      errors(log, "time: {column: stamp, offset: 1, drift: found}\nquantities: [{run: kinetic_energy, log: w}]\n"),
      HasSubstr("map.yaml:1:41: error: time.drift can only be found together with the offset"));
}

TEST_F(CompareFiles, FramesUnitsAndOrders) {
  // A gyroscope in the base, rotated by 90 deg about x there, in deg/s; orientation as x, y, z, w; a position in mm
  // from another origin; times in ms, late by 1.5 s.
  std::string log = "t [ms],wx,wy,wz,qx,qy,qz,qw,\"p, x\",py,pz,energy\n";
  const TimeSeries run = run_series();
  const Rotationd R_BL = rotation_about({1, 0, 0}, M_PI / 2);
  for (std::size_t k = 50; k < 950; ++k) {
    const double* w = run.series[0].data.data() + 3 * k;
    const double* p = run.series[1].data.data() + 3 * k;
    const double* q = run.series[2].data.data() + 4 * k;
    const Vector3d v =
        transposed_times(rotation_matrix(Quaterniond{q[0], q[1], q[2], q[3]}) * R_BL, Vector3d{w[0], w[1], w[2]});
    const double deg = 180 / M_PI;
    std::ostringstream line;
    line.precision(17);
    line << 1000 * (run.time[k] + 1.5) << ',' << deg * v[0] << ',' << deg * v[1] << ',' << deg * v[2] << ',' << -q[1]
         << ',' << -q[2] << ',' << -q[3] << ',' << -q[0] << ',' << 1000 * (p[0] - 1) << ',' << 1000 * (p[1] - 2) << ','
         << 1000 * p[2] << ',' << run.series[3].data[k] << "\n";
    log += line.str();
  }
  const std::string mapping = R"(schema: grapnel-mapping/1
time: {column: t, offset: found}
quantities:
  - {run: base/angular_velocity, log: [wx, wy, wz], unit: deg/s, frame: base, name: gyro,
     quaternion_wxyz: [0.7071067811865476, 0.7071067811865476, 0, 0], uncertainty: 0.001, bias_uncertainty: 0.1 mrad/s}
  - {run: base/quaternion_wxyz, log: [qx, qy, qz, qw], quaternion_order: xyzw, uncertainty: 0.01 deg}
  - {run: base/position, log: ["p, x", py, pz], unit: mm, origin: [1, 2, 0], uncertainty: 0.1}
  - {run: kinetic_energy, log: energy, uncertainty: 0.001 J}
  - {run: base/position/y, log: py, unit: mm, scale: -1, name: mirrored, uncertainty: 0.1 mm, align: false}
)";
  const LogComparison comparison = compare_log(folder_.path(), write("log.csv", log), write("map.yaml", mapping));
  const ComparisonReport& report = comparison.report;
  EXPECT_NEAR(report.clock.offset, -1.5, 1e-5);
  ASSERT_EQ(report.quantities.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(report.quantities[i].verdict, Verdict::yes) << report.quantities[i].name << report.quantities[i].reason;
    EXPECT_EQ(report.quantities[i].compared, 900u);
  }
  EXPECT_DOUBLE_EQ(*report.quantities[0].uncertainty, 0.001 * M_PI / 180);
  EXPECT_DOUBLE_EQ(*report.quantities[0].bias_uncertainty, 1e-4);
  EXPECT_DOUBLE_EQ(*report.quantities[1].uncertainty, 0.01 * M_PI / 180);
  EXPECT_LT(*report.quantities[0].rms, 1e-6);
  EXPECT_LT(*report.quantities[1].rms, 1e-6);
  EXPECT_LT(*report.quantities[2].rms, 1e-6);
  EXPECT_EQ(report.quantities[4].verdict, Verdict::no);
  EXPECT_EQ(report.verdict, Verdict::no);
  EXPECT_THAT(comparison.residuals_csv, HasSubstr("quantity,component,unit,time [s],log time [s],residual,status\n"));
}

// A camera on the base, which turns about z, sees a marker on debris that turns about x.
TEST_F(CompareFiles, MarkersOnMovingBodiesInMovingFrames) {
  TimeSeries run;
  run.phases = {"approach"};
  run.series = {{"base/position", "m", "", {"x", "y", "z"}, {}},
                {"base/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}},
                {"targets/debris/position", "m", "", {"x", "y", "z"}, {}},
                {"targets/debris/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}}};
  std::string log = "time,x,y,z,wx,wy,wz\n";
  for (int k = 0; k <= 200; ++k) {
    const double t = 0.05 * k, a = 0.3 * t, b = 0.5 * t + 0.1;
    const std::vector<std::vector<double>> values{{0.1 * t, 0.2, -0.05 * t},
                                                  {std::cos(a / 2), 0, 0, std::sin(a / 2)},
                                                  {2 - 0.1 * t, 0.3 * std::sin(t), 0.4},
                                                  {std::cos(b / 2), std::sin(b / 2), 0, 0}};
    run.time.push_back(t), run.phase.push_back(0);
    for (std::size_t i = 0; i < 4; ++i)
      run.series[i].data.insert(run.series[i].data.end(), values[i].begin(), values[i].end());
    // The marker at (0.3, -0.2, 0.1) of the debris; the camera at (0.1, 0, 0.05) of the base.
    const double x = values[2][0] + 0.3, y = values[2][1] - 0.2 * std::cos(b) - 0.1 * std::sin(b),
                 z = values[2][2] - 0.2 * std::sin(b) + 0.1 * std::cos(b);
    const double dx = x - values[0][0], dy = y - values[0][1], dz = z - values[0][2];
    std::ostringstream line;
    line.precision(17);
    line << t << ',' << std::cos(a) * dx + std::sin(a) * dy - 0.1 << ',' << -std::sin(a) * dx + std::cos(a) * dy << ','
         << dz - 0.05 << ',' << x - 7 << ',' << y << ',' << z << "\n";
    log += line.str();
  }
  write_timeseries_hdf5(run, {"1.0", "synthetic", "abc"}, folder_.path() / "timeseries.h5");
  const std::string mapping = R"(quantities:
  - {name: camera, run: targets/debris/position, log: [x, y, z], frame: base, origin: [0.1, 0, 0.05],
     marker: [0.3, -0.2, 0.1], uncertainty: 1e-6}
  - {name: tracker, run: targets/debris/position, log: [wx, wy, wz], origin: [7, 0, 0], marker: [0.3, -0.2, 0.1]}
  - {name: centre, run: targets/debris/position, log: [wx, wy, wz], origin: [7, 0, 0]}
)";
  const auto& q = compare_log(folder_.path(), write("log.csv", log), write("map.yaml", mapping)).report.quantities;
  ASSERT_EQ(q.size(), 3u);
  EXPECT_EQ(q[0].verdict, Verdict::yes) << q[0].reason;
  EXPECT_LT(*q[0].rms, 1e-14);
  EXPECT_LT(*q[1].rms, 1e-14);
  EXPECT_NEAR(*q[2].rms, std::sqrt(0.14 / 3), 1e-12);  // the marker's distance from the centre
  EXPECT_THAT(errors(log, "quantities: [{run: base/quaternion_wxyz, log: [x, y, z, wx], marker: [0, 0, 1]}]\n"),
              HasSubstr("a marker has a meaning only for the position of a body whose orientation is in the run"));
}

TEST_F(CompareFiles, ReportsAllErrorsTogether) {
  const std::string log = "time,gyro_x,gyro_y,state\n0,1,2,on\n0.1,1,2,on\n0.2,1,abc,on\n0.3,1,x,off\n0.4,1\n";
  const std::string text = errors(log, R"(time: {column: tme}
quantities:
  - {run: base/angular_velocity/x, log: gyro_x, unit: deg}
  - {run: base/angular_velocty, log: [gyro_x, gyro_y, gyroz]}
  - {run: kinetic_energy, log: gyro_y, frame: bse}
)");
  EXPECT_THAT(text,
              AllOf(HasSubstr("log.csv:4:7: error: 'gyro_y' must be a number, not the text 'abc' (the first of 2"),
                    HasSubstr("log.csv:6:1: error: the line has 2 fields, must have 4")));
  EXPECT_THAT(text, AllOf(HasSubstr("map.yaml:1:16: error: the log has no column 'tme'; did you mean 'time'?"),
                          HasSubstr("map.yaml:4:11: error: the run has no series 'base/angular_velocty'; did you mean "
                                    "'base/angular_velocity'?"),
                          HasSubstr("map.yaml:4:55: error: the log has no column 'gyroz'"),
                          HasSubstr("map.yaml:5:47: error: the run has no orientation 'bse/quaternion_wxyz'; bodies "
                                    "are base")));
  const std::string sound = "time,gyro_x,gyro_y,state\n0,1,2,on\n0.1,1,2,on\n0.2,1,,on\n";
  const std::string units = errors(sound, R"(quantities:
  - {run: base/angular_velocity/x, log: gyro_x, unit: deg, uncertainty: 1 mm}
  - {run: base/position, log: [gyro_x, gyro_y]}
  - {run: kinetic_energy, log: state}
)");
  EXPECT_THAT(units, AllOf(HasSubstr("map.yaml:2:55: error: the log is in deg, but base/angular_velocity of the run is "
                                     "in rad/s"),
                           HasSubstr("error: base/position has 3 components, the log's columns are 2"),
                           HasSubstr("log.csv:2:7: error: 'state' must be a number, not the text 'on'")));
}

TEST_F(CompareFiles, ReportsDamagedLogs) {
  const std::string mapping = "quantities: [{run: kinetic_energy, log: energy}]\n";
  EXPECT_THAT(errors("", mapping), HasSubstr("log.csv:1:1: error: the log is empty"));
  EXPECT_THAT(errors("1,2\n3,4\n", mapping), HasSubstr("log.csv:1:1: error: the log has no line with the names"));
  EXPECT_THAT(errors("time,energy\n0,1\n0.2,1\n0.1,1\n0.3,1\n", mapping),
              HasSubstr("log.csv:4:1: error: the time is 0.1 s, must not be less than 0.2 s of the previous sample"));
  EXPECT_THAT(errors("time;energy\n0;1,5\n0.2;1\n", mapping), HasSubstr("use a decimal point, write 1.5"));
  EXPECT_THAT(errors("time,energy,energy\n0,1,1\n", mapping), HasSubstr("log.csv:1:13: error: duplicate column"));
  EXPECT_EQ(errors("# by numpy\n# time energy\n#time\tenergy\n0\t1\n0.2\t1\n0.4\t1\n", mapping), "");
  EXPECT_THAT(errors("a,b\n0,1\n", ""), HasSubstr("no column has the name of a series of the run"));

  std::ofstream(folder_.path() / "bad.h5", std::ios::binary) << "\x89HDF\r\n\x1a\n and nothing";
  std::ofstream(folder_.path() / "bad.mat", std::ios::binary) << "MATLAB 5.0 MAT-file and nothing";
  for (const char* name : {"bad.h5", "bad.mat"}) {
    FaultList faults;
    EXPECT_FALSE(read_log(folder_.path() / name, {"energy"}, faults));
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_THAT(faults.all()[0].text(), HasSubstr(std::string(name) + ": error: cannot read the log: "));
  }
}

TEST_F(CompareFiles, ReadsColumnsOfDatasets) {
  FaultList faults;
  const auto log = read_log(folder_.path() / "timeseries.h5", {"/base/position[1]"}, faults);
  ASSERT_TRUE(log);
  const auto column = find_column(log->datasets, "base/position[1]");
  ASSERT_TRUE(column);
  EXPECT_EQ(column->column, 1u);
  EXPECT_EQ(log->datasets[column->dataset].unit, "m");
  EXPECT_EQ(log->datasets[column->dataset].values, run_series().series[1].data);
  EXPECT_FALSE(find_column(log->datasets, "base/position[3]"));
  for (const LogDataset& one : log->datasets) EXPECT_EQ(one.values.empty(), one.name != "base/position");
}

}  // namespace compare_files_test
}  // namespace grapnel
