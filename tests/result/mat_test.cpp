#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <memory>

#include "grapnel/result/hdf5_writer.hpp"
#include "grapnel/result/series_export.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace mat_test {

using test::sample_metadata;
using test::sample_series;
using test::TemporaryFolder;

/// A MAT file's one variable.
class Loaded {
 public:
  explicit Loaded(const std::filesystem::path& path) {
    mat_t* file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
    if (file == nullptr) return;
    root_.reset(Mat_VarRead(file, "grapnel"));
    Mat_Close(file);
  }
  /// The field at "a.b.c", or null.
  matvar_t* at(const std::string& path) const {
    matvar_t* variable = root_.get();
    for (std::size_t begin = 0; variable != nullptr && begin <= path.size();) {
      const std::size_t end = std::min(path.find('.', begin), path.size());
      variable = Mat_VarGetStructFieldByName(variable, path.substr(begin, end - begin).c_str(), 0);
      begin = end + 1;
    }
    return variable;
  }
  std::vector<double> numbers(const std::string& path) const {
    const matvar_t* variable = at(path);
    if (variable == nullptr || variable->class_type != MAT_C_DOUBLE) return {};
    const auto* data = static_cast<const double*>(variable->data);
    return {data, data + variable->nbytes / sizeof(double)};
  }

 private:
  struct Free {
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
  };
  std::unique_ptr<matvar_t, Free> root_;
};

TEST(Mat, HoldsColumnsThatMatlabPlots) {
  const TemporaryFolder folder;
  const TimeSeries series = sample_series(701);
  write_timeseries_mat(series, sample_metadata(), folder / "a.mat");
  EXPECT_EQ(folder.files(), 1);
  const Loaded mat(folder / "a.mat");
  EXPECT_EQ(mat.numbers("time"), series.time);
  std::vector<double> columns;
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t i = 0; i < 701; ++i) columns.push_back(series.series[0].data[3 * i + j]);
  }
  EXPECT_TRUE(test::same_numbers(mat.numbers("base.position"), columns));
  ASSERT_NE(mat.at("base.position"), nullptr);
  EXPECT_EQ(mat.at("base.position")->dims[0], 701u);
  EXPECT_EQ(mat.at("base.position")->dims[1], 3u);
  EXPECT_TRUE(test::same_numbers(mat.numbers("kinetic_energy"), series.series[2].data));
  // left-hand and left_hand are one name in MATLAB; a group info and a series end are names that are taken.
  EXPECT_EQ(mat.numbers("end_effectors.left_hand.velocity").size(), 3 * 701u);
  EXPECT_EQ(mat.numbers("end_effectors.left_hand_2.velocity").size(), 3 * 701u);
  EXPECT_EQ(mat.numbers("info_2.xend"), series.series[6].data);
  ASSERT_NE(mat.at("phase"), nullptr);
  EXPECT_EQ(mat.at("phase")->class_type, MAT_C_INT32);
  EXPECT_EQ(static_cast<const std::int32_t*>(mat.at("phase")->data)[0], 1);
  EXPECT_EQ(static_cast<const std::int32_t*>(mat.at("phase")->data)[700], 2);
}

TEST(Mat, TheSameSeriesGivesTheSameBytes) {
  const TemporaryFolder folder;
  write_timeseries_hdf5(sample_series(701), sample_metadata(), folder / "timeseries.h5");
  EXPECT_EQ(export_mat(folder.path()), folder / "timeseries.mat");
  const std::string first = test::bytes_of(folder / "timeseries.mat");
  export_mat(folder.path());
  EXPECT_EQ(test::bytes_of(folder / "timeseries.mat"), first);
}

TEST(Mat, IsReadByScipy) {
  for (const int samples : {0, 1, 701}) {
    const TemporaryFolder folder;
    write_timeseries_mat(sample_series(samples), sample_metadata(), folder / "a.mat");
    std::string output;
    const int status =
        test::run_python("read_mat.py", (folder / "a.mat").string() + " " + std::to_string(samples), output);
    if (status == 77) GTEST_SKIP() << output;
    EXPECT_EQ(status, 0) << output;
  }
}

TEST(Mat, HoldsASeriesOfNothing) {
  const TemporaryFolder folder;
  write_timeseries_mat({}, {}, folder / "a.mat");
  EXPECT_NE(Loaded(folder / "a.mat").at("time"), nullptr);
}

TEST(Mat, ReportsPathAndReason) {
  const TemporaryFolder folder;
  EXPECT_THAT(
      test::message_of([&] { write_timeseries_mat(sample_series(5), sample_metadata(), folder / "none/a.mat"); }),
      testing::AllOf(testing::HasSubstr("none/a.mat"), testing::HasSubstr("No such file")));
}

TEST(MatNames, AreValidInMatlab) {
  EXPECT_EQ(matlab_name("left-hand"), "left_hand");
  EXPECT_EQ(matlab_name("2nd"), "x2nd");
  EXPECT_EQ(matlab_name("_a"), "x_a");
  EXPECT_EQ(matlab_name("end"), "xend");
  EXPECT_EQ(matlab_name(""), "x");
  EXPECT_EQ(matlab_name(std::string(100, 'a')).size(), 63u);
  std::set<std::string> taken;
  EXPECT_EQ(unique_matlab_name("a-b", taken), "a_b");
  EXPECT_EQ(unique_matlab_name("a b", taken), "a_b_2");
  EXPECT_EQ(unique_matlab_name("a.b", taken), "a_b_3");
  unique_matlab_name(std::string(100, 'a'), taken);
  EXPECT_EQ(unique_matlab_name(std::string(100, 'a'), taken), std::string(61, 'a') + "_2");
}

}  // namespace mat_test
}  // namespace grapnel
