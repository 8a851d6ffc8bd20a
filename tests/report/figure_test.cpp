// Figures: contents of data and script, output of gnuplot; names are never executed.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "grapnel/report/drawn_shape.hpp"
#include "grapnel/report/figure.hpp"
#include "grapnel/report/figure_script.hpp"
#include "report/sample_run.hpp"
#include "result/sample_result.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace figure_test {

namespace fs = std::filesystem;
using test::sample_run;
using test::TemporaryFolder;

FigureRequest request_for(const std::string& what) {
  FigureRequest request;
  request.folder = "made-up", request.what = what, request.command = "grapnel figure";
  return request;
}

// Rows of numbers of a data file.
std::vector<std::vector<double>> rows_of(const std::string& data) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(data);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::vector<double> row;
    for (double v; fields >> v;) row.push_back(v);
    rows.push_back(row);
  }
  return rows;
}

bool has_gnuplot() { return run_gnuplot(fs::temp_directory_path(), "grapnel-no-such-script.gp").found; }

TEST(GnuplotText, QuotesExecutableText) {
  EXPECT_EQ(gnuplot_quoted("it's `id` \\n @x\n\"%d\""), "'it''s `id` \\n @x \"%d\"'");
  EXPECT_EQ(gnuplot_quoted("\xff\xc3\xa4\xe2\x82"), "'?\xc3\xa4?\?'");
  EXPECT_EQ(gnuplot_tic_label("50 %g"), "'50 %%g'");
  EXPECT_EQ(gnuplot_file("fig.dat"), "'fig.dat'");
  EXPECT_EQ(gnuplot_file("|rm -r x"), "'./|rm -r x'");
  EXPECT_EQ(gnuplot_file("<id"), "'./<id'");
  EXPECT_EQ(gnuplot_file("-"), "'./-'");
  EXPECT_EQ(gnuplot_file("~/it's"), "'./~/it''s'");
  EXPECT_THROW(gnuplot_file("a\nb"), std::invalid_argument);
}

TEST(GnuplotText, ApostrophesAtTheBeginningAreText) {
  EXPECT_EQ(gnuplot_quoted("'left' arm"), "\"'\".'left'' arm'");
  EXPECT_EQ(gnuplot_quoted("''"), "\"''\".''");
  EXPECT_EQ(gnuplot_quoted("a''b'c"), "'a'.\"''\".'b''c'");
  EXPECT_EQ(gnuplot_file("a'''.dat"), "'a'.\"'''\".'.dat'");
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  const TemporaryFolder folder;
  for (const std::string text : {"'left' arm", "'", "''a", "a'", "'%d`id`", "'\\"}) {
    std::ofstream(folder / "a.gp") << "set print 'out'\nprint " << gnuplot_quoted(text) << "\nset label "
                                   << gnuplot_quoted(text) << " at 1,1 noenhanced\nset xtics ("
                                   << gnuplot_tic_label(text) << " 1)\n";
    const GnuplotOutcome outcome = run_gnuplot(folder.path(), "a.gp");
    EXPECT_EQ(outcome.status, 0) << text << ": " << outcome.message;
    EXPECT_EQ(test::bytes_of(folder / "out"), text + "\n");
  }
}

TEST(Figure, ReplacesSymbolicLinksWithoutPartialFiles) {
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  const TemporaryFolder folder;
  test::put_bytes(folder / "precious", "x");
  fs::create_symlink(folder / "precious", folder / "joints.svg");
  ASSERT_TRUE(write_figure(series_figure(sample_run(false), request_for("joints")), folder / "joints.svg").drawn);
  EXPECT_EQ(test::bytes_of(folder / "precious"), "x");
  EXPECT_FALSE(fs::is_symlink(folder / "joints.svg"));
  EXPECT_NE(test::bytes_of(folder / "joints.svg").find("</svg>"), std::string::npos);
  EXPECT_EQ(folder.files(), 4);  // image, data, script, and the earlier file
}

TEST(Figure, DataFileHasOriginAndRecordedValues) {
  const RunSource run = sample_run(true);
  const Figure figure = series_figure(run, request_for("joints"));
  const std::string data = figure_data(figure);
  for (const char* text : {"# joints of scenario made up", "Grapnel 1.2.3", "sha256 of the scenario 0123456789abcdef",
                           "# made by: grapnel figure", "# column 1: time [s]",
                           "# column 3: joint angle, joint-1 [rad]", "# column 6: joint rate, joint-2 [rad/s]"})
    EXPECT_NE(data.find(text), std::string::npos) << text << "\n" << data.substr(0, 600);
  const std::vector<std::vector<double>> rows = rows_of(data);
  ASSERT_EQ(rows.size(), run.series.time.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 6u);
    EXPECT_NEAR(rows[i][0], run.series.time[i], 1e-9);
    EXPECT_NEAR(rows[i][2], std::sin(0.3 * run.series.time[i]), 1e-9);
    EXPECT_NEAR(rows[i][4], run.series.phase[i] == 0 ? 0.1 : 0.25, 1e-9);
  }
}

TEST(Figure, RelativeVelocityIsThatOfTheGraspPoint) {
  const RunSource run = sample_run(true);
  const std::vector<std::vector<double>> rows = rows_of(figure_data(series_figure(run, request_for("relative"))));
  // The point at (-0.5, 0) of a ball that rotates at 1.7 rad/s: v = (-0.03, 0) + w x r.
  for (const std::size_t i : {0u, 37u, 150u}) {
    const double angle = 1.7 * run.series.time[i];
    const double vx = -0.03 + 1.7 * 0.5 * std::sin(angle), vy = -1.7 * 0.5 * std::cos(angle);
    EXPECT_NEAR(rows[i][2], 0 - vx, 1e-9);
    EXPECT_NEAR(rows[i][3], 0.05 - vy, 1e-9);
    EXPECT_NEAR(rows[i][4], 0.2 - 1.7, 1e-9);
  }
}

TEST(Figure, PhasesAndTimesSelectSamples) {
  const RunSource run = sample_run(true);
  FigureRequest request = request_for("joints");
  request.phases = {"post_impact"};
  request.from = 12;
  EXPECT_EQ(rows_of(figure_data(series_figure(run, request))).size(), 81u);
  request.phases = {"landing"};
  try {
    series_figure(run, request);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "there is no phase 'landing'; there are: approach, contact, post_impact");
  }
}

TEST(Figure, ShortSpansAreInMilliseconds) {
  FigureRequest request = request_for("joints");
  request.from = 4, request.to = 5;
  const std::string data = figure_data(series_figure(sample_run(true), request));
  EXPECT_NE(data.find("# column 1: time after 4 s [ms]"), std::string::npos);
  EXPECT_NEAR(rows_of(data).back()[0], 1000, 1e-6);
}

TEST(Figure, StrobeShowsTheBodiesWhereTheyWere) {
  const RunSource run = sample_run(true);
  FigureRequest request = request_for("strobe");
  request.phases = {"approach"};
  request.times = {0, 10};
  const Figure figure = strobe_figure(run, request);
  // The ball's outline: 36 corners half a metre around its centre, at both instants.
  int outlines = 0;
  for (const FigureBlock& block : figure.blocks) {
    for (const double time : {0.0, 10.0}) {
      bool all = block.rows.size() == 38;  // one closed polygon, and its end
      for (const std::vector<double>& row : block.rows)
        all = all && (row.empty() || std::abs(std::hypot(row[0] - 3 + 0.03 * time, row[1] - 1) - 0.5) < 1e-9);
      outlines += all ? 1 : 0;
    }
  }
  EXPECT_EQ(outlines, 2);
  EXPECT_TRUE(figure.equal_axes);
}

TEST(Figure, StrobeSeesInSpaceAlongEveryView) {
  const RunSource run = sample_run(false);
  for (const char* view : {"x", "y", "z", "iso"}) {
    FigureRequest request = request_for("strobe");
    request.view = view;
    const Figure figure = strobe_figure(run, request);
    EXPECT_EQ(figure.panels.size(), 2u) << view;
    EXPECT_EQ(figure.panels[0].bare, std::string(view) == "iso");
  }
  const View iso = view_along("iso");
  EXPECT_NEAR(dot(cross(iso.right, iso.up), iso.towards), 1, 1e-15);
  EXPECT_NEAR(norm(iso.towards - (1 / std::sqrt(3.0)) * Vector3d{1, 1, 1}), 0, 1e-15);
}

TEST(Outline, HullIsConvexAndComplete) {
  const std::vector<Point2> hull = convex_hull({{0, 0}, {1, 0}, {0.5, 0.5}, {1, 1}, {0, 1}, {0.5, 0}, {1, 0}});
  EXPECT_EQ(hull, (std::vector<Point2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
}

TEST(Outline, PartsOfAMeshHaveSeparateOutlines) {
  Scene scene;
  SceneMesh& mesh = scene.meshes.emplace_back();
  for (const double at : {0.0, 10.0}) {  // a tetrahedron, and another one beside it
    const int first = static_cast<int>(mesh.vertices.size() / 3);
    mesh.vertices.insert(mesh.vertices.end(), {at, 0, 0, at + 1, 0, 0, at, 1, 0, at, 0, 1});
    for (const int k : {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}) mesh.triangles.push_back(first + k);
  }
  SceneShape shape;
  shape.shape = "mesh", shape.size = {1, 1, 1}, shape.mesh = 0;
  const std::vector<Silhouette> parts = silhouettes_of(scene, shape);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].centre()[0], 0.25);
  EXPECT_EQ(parts[1].centre()[0], 10.25);
  for (const Silhouette& part : parts) EXPECT_EQ(part(Posed::identity(), view_along("z")).size(), 3U);
  shape.shape = "box";
  EXPECT_EQ(silhouettes_of(scene, shape).size(), 1U);
}

// Ten joints in one panel cannot be distinguished.
TEST(Figure, ArmsWithManyJointsHaveAPanelEach) {
  RunSource run = sample_run(false);
  std::vector<std::string> names;
  run.scene->bodies.resize(1);
  for (const char* arm : {"left-", "right-"}) {
    std::string parent = run.scene->bodies[0].name;
    for (int k = 0; k < 5; ++k) {
      SceneBody link;
      link.name = names.emplace_back(arm + std::to_string(k)), link.kind = "link", link.parent = parent;
      link.joint = SceneJoint{link.name, "revolute", {0, 0, 1}, Posed::identity()};
      parent = link.name;
      run.scene->bodies.push_back(link);
    }
  }
  for (const char* path : {"joints/position", "joints/velocity"}) {
    std::erase_if(run.series.series, [&](const Series& one) { return one.path == path; });
    run.series.series.push_back({path, "rad", "", names, std::vector<double>(10 * run.series.time.size(), 0.5)});
  }
  const Figure figure = series_figure(run, request_for("joints"));
  ASSERT_EQ(figure.panels.size(), 4U);
  EXPECT_EQ(figure.columns, 2);
  for (const FigurePanel& panel : figure.panels) EXPECT_EQ(panel.items.size(), 5U);
  EXPECT_EQ(figure.panels[1].y_label, "joint angle, arm 2 [rad]");
  EXPECT_EQ(series_figure(sample_run(false), request_for("joints")).panels.size(), 2U);
}

TEST(Figure, GnuplotDrawsEveryKindAndTheScriptAlone) {
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  TemporaryFolder folder;
  for (const char* what : {"joints", "velocities", "base"}) {
    for (const char* ending : {".pdf", ".svg", ".png"}) {
      if (test::kSanitized && std::string(what) != "joints") continue;
      const FigureFiles files =
          write_figure(series_figure(sample_run(false), request_for(what)), folder / (std::string(what) + ending));
      EXPECT_TRUE(files.drawn);
      EXPECT_GT(fs::file_size(files.image), 1000u) << files.image;
    }
  }
  const FigureFiles files =
      write_figure(strobe_figure(sample_run(false), request_for("strobe")), folder / "strobe.svg");
  const std::string first = test::bytes_of(files.image);
  EXPECT_GT(first.size(), 5000u);
  fs::remove(files.image);
  EXPECT_EQ(run_gnuplot(folder.path(), "strobe.gp").status, 0);
  EXPECT_EQ(test::bytes_of(files.image), first);
}

TEST(Figure, HostileNamesAreOnlyNames) {
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  TemporaryFolder folder;
  const std::string trap = (folder / "trap").string();
  const std::string odd = "'`touch " + trap + "`\"; system('touch " + trap + "'); @x $(touch " + trap +
                          ") {/:Bold a_b^c} %d\\n\n<b>&amp;\xff";
  for (const char* ending : {".pdf", ".svg", ".png"}) {
    const FigureFiles drawn = write_figure(series_figure(sample_run(true, odd), request_for("joints")),
                                           folder / ("f'`touch trap`" + std::string(ending)));
    EXPECT_TRUE(fs::exists(drawn.image)) << drawn.image;
    const FigureFiles pipe = write_figure(strobe_figure(sample_run(true, odd), request_for("strobe")),
                                          folder / ("|touch trap" + std::string(ending)));
    EXPECT_TRUE(fs::exists(pipe.image)) << pipe.image;
  }
  EXPECT_FALSE(fs::exists(trap));
  const std::string svg = test::bytes_of(folder / "f'`touch trap`.svg");
  EXPECT_NE(svg.find("a_b^c"), std::string::npos);  // as plain text, not as subscript and superscript
  EXPECT_EQ(svg.find("<b>"), std::string::npos);
  EXPECT_EQ(svg.find('\xff'), std::string::npos);
}

TEST(Figure, ABackslashAtTheEndOfAHeadTakesNothingWithIt) {
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  TemporaryFolder folder;
  Figure figure = series_figure(sample_run(true), request_for("joints"));
  figure.heads.push_back("odd\\");
  const FigureFiles files = write_figure(figure, folder / "joints.svg");
  const std::string script = test::bytes_of(files.script);
  test::put_bytes(folder / "show.gp", script + "show encoding\n");
  EXPECT_NE(run_gnuplot(folder.path(), "show.gp").message.find("encoding is utf8"), std::string::npos);
}

// Contents of a damaged file.
TEST(Figure, SeriesOfAnotherWidthAreErrors) {
  RunSource run = sample_run(true);
  for (Series& s : run.series.series) {
    if (s.path == "base/angular_velocity") s.components = {"x"}, s.data.resize(run.series.time.size());
  }
  EXPECT_EQ(test::message_of([&] { series_figure(run, request_for("base")); }),
            "the time series 'base/angular_velocity' have 1 components");
  run.series.series.push_back({"grasps/tip/distance", "m", "", {}, {}});
  EXPECT_EQ(test::message_of([&] { series_figure(run, request_for("distance")); }),
            "the time series 'grasps/tip/distance' have 0 components");
}

TEST(Figure, ARunWithoutEndEffectorsHasNoVelocities) {
  RunSource run = sample_run(true);
  std::erase_if(run.series.series, [](const Series& s) { return s.path.starts_with("end_effectors/"); });
  EXPECT_EQ(test::message_of([&] { series_figure(run, request_for("velocities")); }),
            "the run has not recorded the velocity of any end-effector");
}

TEST(Figure, OneAttitudeThatIsNoNumberSpoilsNoOther) {
  RunSource run = sample_run(true);
  for (Series& s : run.series.series) {
    if (s.path == "base/quaternion_wxyz") s.data[4 * 7] = std::nan("");
  }
  const std::vector<std::vector<double>> rows = series_figure(run, request_for("base")).blocks[0].rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].empty()) continue;
    EXPECT_EQ(std::isnan(rows[i][2]), i == 7) << i;
  }
}

TEST(Figure, WithoutGnuplotDataAndScriptAreThere) {
  TemporaryFolder folder;
  const std::string path = std::getenv("PATH");
  ASSERT_EQ(::setenv("PATH", folder.path().c_str(), 1), 0);
  const FigureFiles files = write_figure(series_figure(sample_run(true), request_for("joints")), folder / "joints.pdf");
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_FALSE(files.drawn);
  EXPECT_FALSE(fs::exists(files.image));
  EXPECT_TRUE(fs::exists(files.data));
  EXPECT_TRUE(fs::exists(files.script));
}

TEST(Figure, UnknownEndingIsRefused) {
  TemporaryFolder folder;
  const Figure figure = series_figure(sample_run(true), request_for("joints"));
  EXPECT_EQ(test::message_of([&] { write_figure(figure, folder / "joints.jpg"); }),
            "'joints.jpg': a figure's file ends in .pdf, .svg or .png");
  EXPECT_EQ(folder.files(), 0);
}

const char* kStudy =
    R"({"schema": "grapnel-study-table/1", "version": "1", "study": {"name": "s", "sha256": "0", "simulate": "impact"}, "points": 4,
 "axes": [{"name": "speed", "unit": "m/s", "description": "", "values": [0.1, 0.2]},
          {"name": "spin", "unit": "", "description": "", "values": ["it's 50 %", "at rest"]}],
 "columns": [{"name": "grasps/tip/impulse_magnitude", "unit": "N s", "description": ""}, {"name": "rank", "unit": "1", "description": ""}]})";
const char* kTable =
    "point,speed [m/s],spin,status,reason,grasps/tip/impulse_magnitude [N s],rank [1]\n"
    "0,0.1,it's 50 %,ok,,1,6\n1,0.1,at rest,ok,,2,6\n2,0.2,it's 50 %,failed,\"a, b\",NaN,NaN\n3,0.2,at rest,ok,,4,6\n";

TEST(StudyFigure, HasALinePerValueOfTheSecondAxis) {
  TemporaryFolder folder;
  test::put_bytes(folder / "study.json", kStudy);
  test::put_bytes(folder / "table.csv", kTable);
  FigureRequest request = request_for("impulse-map");
  request.folder = folder.path();
  Figure figure = make_figure(request);
  ASSERT_EQ(figure.blocks.size(), 2u);
  EXPECT_EQ(figure.blocks[1].about, "spin = at rest");
  EXPECT_EQ(figure.blocks[1].rows, (std::vector<std::vector<double>>{{0.1, 2}, {0.2, 4}}));
  EXPECT_TRUE(std::isnan(figure.blocks[0].rows[1][1]));
  request.x_axis = "spin", request.columns = {"rank"};
  figure = make_figure(request);
  EXPECT_EQ(figure.blocks.size(), 2u);  // one per speed
  if (has_gnuplot()) {
    EXPECT_TRUE(write_figure(figure, folder / "map.svg").drawn);
  }
  request.heat_map = true;
  EXPECT_EQ(test::message_of([&] { make_figure(request); }),
            "a heat map needs two axes of numbers with several values each");
  request.columns = {"nothing"};
  EXPECT_EQ(test::message_of([&] { make_figure(request); }),
            "the study has no column 'nothing'; it has: grasps/tip/impulse_magnitude, rank");
  std::string table = kTable;
  test::put_bytes(folder / "table.csv", table.replace(table.find("2,0.2,"), 6, "2,NaN,"));
  EXPECT_EQ(test::message_of([&] { make_figure(request); }),
            (folder / "table.csv").string() + ": axis 'speed' has a value that is not finite");
  test::put_bytes(folder / "table.csv", table.replace(table.find("rank [1]"), 8, "spin [1]"));
  EXPECT_NE(test::message_of([&] { make_figure(request); }).find("'spin [1]' where study.json has 'rank [1]'"),
            std::string::npos);
  request = request_for("strobe");
  request.folder = folder.path();
  EXPECT_NE(test::message_of([&] { make_figure(request); }).find("has no figure 'strobe'; it has: impulse-map"),
            std::string::npos);
}

// Capture times: evaluated values, gaps for unknown values, and no such figure for other runs.
TEST(WindowFigure, HasEveryTimeAndItsLimits) {
  RunSource run = sample_run(false);
  EXPECT_FALSE(has_window(run));
  EXPECT_THROW(window_figure(run, request_for("window")), std::runtime_error);
  run.summary = nlohmann::ordered_json::parse(R"({"approach": {"plan": {"window": {"time": 7.5, "not_before": 5.5,
    "points": [{"time": 5, "reachable": false, "reason": "far", "objective": null, "speed": 0.5, "direction_angle": null, "reach_share": 1.25},
               {"time": 7.5, "reachable": true, "reason": "", "objective": 2, "speed": 0.25, "direction_angle": null, "reach_share": 0.75}]}}}})");
  ASSERT_TRUE(has_window(run));
  const Figure figure = window_figure(run, request_for("window"));
  ASSERT_EQ(figure.panels.size(), 3u);  // no direction angles
  EXPECT_EQ(figure.panels.back().x_label, "time of capture [s]");
  const std::vector<std::vector<double>>& rows = figure.blocks.at(0).rows;
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][1], 1.25);
  EXPECT_EQ(rows[0][5], 0);
  EXPECT_TRUE(std::isnan(rows[0][4]));
  EXPECT_EQ(rows[1][4], 2);
  EXPECT_EQ(rows[1][5], 1);
  const std::string data = figure_data(figure);
  EXPECT_NE(data.find("selected: t = 7.5 s"), std::string::npos);
  EXPECT_NE(data.find("none before t = 5.5 s"), std::string::npos);
  if (!has_gnuplot()) GTEST_SKIP() << "no gnuplot";
  const TemporaryFolder folder;
  EXPECT_TRUE(write_figure(figure, folder / "window.svg").drawn);
}

}  // namespace figure_test
}  // namespace grapnel
