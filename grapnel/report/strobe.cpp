#include "grapnel/report/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "grapnel/report/drawn_shape.hpp"
#include "grapnel/report/series_table.hpp"

namespace grapnel {
namespace {

constexpr int kInstants = 6;
constexpr double kShortPhase = 0.05;  // relative to the run: shorter phases get no separate panel
constexpr double kPathBound = 1e-3;   // relative to a path's size: tolerance of straight lines between its points
constexpr double kMargin = 0.05;      // margin around the drawing, relative to its size

// A body ready to be drawn.
struct Actor {
  RecordedPose pose;
  std::string color;
  std::vector<Silhouette> shapes;
  bool is_target = false;
  std::vector<Vector3d> grasp_points;  // of targets
  bool turns = false;                  // of links: about a joint
};

std::vector<Actor> actors_of(const RunSource& run) {
  const Scene& scene = *run.scene;
  const std::vector<ArmPlace> places = body_places(scene);
  std::vector<Actor> actors;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const SceneBody& body = scene.bodies[i];
    const bool link = body.kind == "link";
    Actor actor{RecordedPose(run.series, body.series),
                link                                           ? series_color(places[i].arm)
                : body.kind == "target" || body.kind == "part" ? kTargetColor
                                                               : kBaseColor,
                {},
                body.kind == "target",
                {},
                link && body.joint && body.joint->type != "fixed"};
    for (const SceneShape& shape : drawn_shapes(scene, i)) {
      for (Silhouette& part : silhouettes_of(scene, shape)) actor.shapes.push_back(std::move(part));
    }
    for (const SceneGraspPoint& point : scene.grasp_points) {
      if (actor.is_target && point.target == body.name) actor.grasp_points.push_back(point.position);
    }
    actors.push_back(std::move(actor));
  }
  return actors;
}

struct Box {
  double low[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  double high[2] = {-low[0], -low[1]};
  void add(const Point2& p) {
    for (int k = 0; k < 2; ++k)
      low[k] = std::min(low[k], p[static_cast<std::size_t>(k)]),
      high[k] = std::max(high[k], p[static_cast<std::size_t>(k)]);
  }
  double size(int k) const { return high[k] - low[k]; }
};

// Draws into one panel and the figure's blocks.
class Stage {
 public:
  Stage(Figure& figure, FigurePanel& panel, Box& box, const View& view)
      : figure_(figure), panel_(panel), box_(box), view_(view) {}

  // Begins an item in one style.
  void begin(const std::string& about, const std::string& style) {
    FigureBlock block;
    block.about = about;
    if (figure_.blocks.empty()) {
      block.columns = {view_.right_name.empty() ? "to the right [m]" : view_.right_name + " [m]",
                       view_.up_name.empty() ? "upwards [m]" : view_.up_name + " [m]"};
    }
    figure_.blocks.push_back(std::move(block));
    panel_.items.push_back({static_cast<int>(figure_.blocks.size()) - 1, style, ""});
  }
  // The same numbers in another style on top.
  void again(const std::string& style) {
    panel_.items.push_back({static_cast<int>(figure_.blocks.size()) - 1, style, ""});
  }
  void point(const Point2& p) {
    figure_.blocks.back().rows.push_back({p[0], p[1]});
    box_.add(p);
  }
  void point(const Vector3d& p) { point(view_(p)); }
  void gap() { figure_.blocks.back().rows.emplace_back(); }
  void polygon(const std::vector<Point2>& corners) {
    if (corners.empty()) return;
    for (const Point2& p : corners) point(p);
    point(corners.front());
    gap();
  }
  const View& view() const { return view_; }

 private:
  Figure& figure_;
  FigurePanel& panel_;
  Box& box_;
  View view_;
};

// One shape of one body, to be sorted by depth.
struct Cutout {
  const Actor* actor;
  const Silhouette* shape;
  double depth;
};

std::vector<Cutout> cutouts_of(const std::vector<Actor>& actors, std::size_t sample, const View& view, bool planar) {
  std::vector<Cutout> cutouts;
  for (const Actor& actor : actors) {
    const Posed X = actor.pose(sample);
    for (const Silhouette& shape : actor.shapes)
      cutouts.push_back({&actor, &shape, dot(view.towards, X * shape.centre())});
  }
  // In the plane arms lie on targets, and targets on the base.
  const auto rank = [](const Cutout& c) { return c.actor->is_target ? 1 : c.actor->color == kBaseColor ? 0 : 2; };
  std::stable_sort(cutouts.begin(), cutouts.end(),
                   [&](const Cutout& a, const Cutout& b) { return planar ? rank(a) < rank(b) : a.depth < b.depth; });
  return cutouts;
}

void draw_instant(Stage& stage, const std::vector<Actor>& actors, std::size_t sample, double time, double strength,
                  bool planar) {
  const Actor* before = nullptr;
  for (const Cutout& cutout : cutouts_of(actors, sample, stage.view(), planar)) {
    const Actor& actor = *cutout.actor;
    if (before == nullptr || before->color != actor.color) {
      stage.begin(
          fmt::format("bodies at {:.6g} s", time),
          fmt::format("using 1:2 with filledcurves closed fc rgb '{}' fs solid border lc rgb '{}' lw {:.2g}",
                      translucent(lightened(actor.color, 0.12 + 0.4 * strength),
                                  planar ? (actor.is_target ? 0.3 : 0.25 + 0.5 * strength) : 0.45 + 0.45 * strength),
                      lightened(actor.color, 0.35 + 0.65 * strength), 0.6 + 0.5 * strength));
    }
    before = &actor;
    stage.polygon((*cutout.shape)(actor.pose(sample), stage.view()));
  }
  const std::string ink = lightened(kInk, 0.2 + 0.8 * strength);
  if (planar) {
    stage.begin(fmt::format("joints at {:.6g} s", time),
                fmt::format("using 1:2 with points pt 7 ps 0.32 lc rgb '{}'", ink));
    for (const Actor& actor : actors) {
      if (actor.turns) stage.point(actor.pose.position(sample));
    }
    stage.again("using 1:2 with points pt 7 ps 0.18 lc rgb '#ffffff'");
  }
  bool any = false;
  for (const Actor& actor : actors) any = any || !actor.grasp_points.empty();
  if (!any) return;
  stage.begin(fmt::format("targets' centres to grasp points at {:.6g} s", time),
              fmt::format("using 1:2 with linespoints pt 7 ps 0.22 lw 0.7 lc rgb '{}'",
                          lightened(kTargetColor, 0.35 + 0.65 * strength)));
  for (const Actor& actor : actors) {
    for (const Vector3d& p : actor.grasp_points) {
      const Posed X = actor.pose(sample);
      stage.point(X.p), stage.point(X * p);
      stage.gap();
    }
  }
}

// Obstacles => a block and an item below those of the bodies. They do not enlarge the picture.
void draw_obstacles(Figure& figure, FigurePanel& panel, const RunSource& run, const View& view) {
  if (run.scene->obstacles.empty()) return;
  FigurePanel behind;
  Box ignored;
  Stage stage(figure, behind, ignored, view);
  stage.begin("obstacles",
              fmt::format("using 1:2 with filledcurves closed fc rgb '{}' fs solid border lc rgb '{}' lw 1",
                          translucent(kObstacleColor, 0.25), kObstacleColor));
  const MotionExtent extent = motion_extent(run);
  for (const SceneObstacle& obstacle : run.scene->obstacles) {
    for (const SceneShape& shape : drawn_shapes(obstacle, extent)) {
      for (const Silhouette& part : silhouettes_of(*run.scene, shape)) stage.polygon(part(obstacle.X_WO, view));
    }
  }
  panel.items.insert(panel.items.end(), behind.items.begin(), behind.items.end());
}

// The point between two others with the largest distance from their straight line, if it exceeds `bound`; else the
// first of the two.
std::size_t farthest_between(const std::vector<Point2>& path, std::size_t first, std::size_t last, double bound) {
  const double dx = path[last][0] - path[first][0], dy = path[last][1] - path[first][1], length = std::hypot(dx, dy);
  std::size_t worst = first;
  double largest = bound;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double x = path[i][0] - path[first][0], y = path[i][1] - path[first][1];
    // A path that reverses leaves its chord in the direction of the chord.
    const double along = length > 0 ? (x * dx + y * dy) / length : 0;
    const double aside = length > 0 ? std::abs(x * dy - y * dx) / length : std::hypot(x, y);
    const double distance =
        along < 0 || along > length ? std::min(std::hypot(x, y), std::hypot(x - dx, y - dy)) : aside;
    if (distance > largest) largest = distance, worst = i;
  }
  return worst;
}

// Points to retain so that straight lines between them deviate from the path by less than `bound` (algorithm of Douglas
// and Peucker, with a list in place of the recursion, which a long path could make too deep).
std::vector<bool> corners_of(const std::vector<Point2>& path, double bound) {
  std::vector<bool> retained(path.size(), false);
  retained.front() = retained.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, path.size() - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const std::size_t worst = farthest_between(path, first, last, bound);
    if (worst == first) continue;
    retained[worst] = true;
    open.push_back({first, worst}), open.push_back({worst, last});
  }
  return retained;
}

// The path of a point over the samples, without points on straight lines.
void draw_path(Stage& stage, const std::vector<std::size_t>& samples, const RecordedPose& pose,
               const std::string& about, const std::string& color) {
  std::vector<Point2> path;
  Box around;
  for (const std::size_t i : samples) {
    path.push_back(stage.view()(pose.position(i)));
    around.add(path.back());
  }
  const double bound = kPathBound * std::max({around.size(0), around.size(1), 1e-2});
  const std::vector<bool> retained = corners_of(path, bound);
  stage.begin(fmt::format("{}, to {:.2g} m", about, bound),
              fmt::format("using 1:2 with lines lc rgb '{}' dt (5,3) lw 0.8", color));
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (retained[i]) stage.point(path[i]);
  }
}

std::vector<std::size_t> instants_of(const TimeSeries& series, const std::vector<std::size_t>& samples,
                                     const FigureRequest& request) {
  const double begin = series.time[samples.front()], end = series.time[samples.back()];
  std::vector<double> times;
  for (const double t : request.times) {
    if (t >= begin - 1e-9 && t <= end + 1e-9) times.push_back(t);
  }
  if (request.times.empty()) {
    const int count = request.instants > 0 ? request.instants : kInstants;
    for (int k = 0; k < count; ++k) times.push_back(count == 1 ? end : begin + (end - begin) * k / (count - 1));
  }
  std::vector<std::size_t> chosen;
  for (const double t : times) {
    std::size_t nearest = samples.front();
    for (const std::size_t i : samples) {
      if (std::abs(series.time[i] - t) < std::abs(series.time[nearest] - t)) nearest = i;
    }
    if (std::find(chosen.begin(), chosen.end(), nearest) == chosen.end()) chosen.push_back(nearest);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// Phases that get a panel.
std::vector<std::string> phases_of(const TimeSeries& series, const FigureRequest& request) {
  if (!request.phases.empty()) return request.phases;
  std::vector<std::string> phases;
  const double whole = series.time.back() - series.time.front();
  for (std::size_t p = 0; p < series.phases.size(); ++p) {
    double begin = 1, end = 0;
    for (std::size_t i = 0; i < series.time.size(); ++i) {
      if (series.phase[i] != static_cast<int>(p) || series.time[i] < request.from || series.time[i] > request.to)
        continue;
      if (end < begin) begin = series.time[i];
      end = series.time[i];
    }
    if (end - begin >= kShortPhase * whole && end > begin) phases.push_back(series.phases[p]);
  }
  if (phases.empty()) phases.push_back(series.phases.front());
  return phases;
}

// Recorded bodies as one direction of view shows them.
struct Strobe {
  const RunSource& run;
  std::vector<Actor> actors;
  View view;
  bool planar;
};

// Paths of end-effectors, targets and, at `last`, the centre of mass.
void draw_paths(Stage& stage, FigurePanel& panel, const RunSource& run, const std::vector<std::size_t>& samples,
                std::size_t last) {
  const std::vector<ArmPlace> places = body_places(*run.scene);
  for (const SceneFrame& end_effector : run.scene->end_effectors) {
    int arm = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (run.scene->bodies[i].name == end_effector.body) arm = places[i].arm;
    }
    draw_path(stage, samples, RecordedPose(run.series, "end_effectors/" + end_effector.name),
              "path of " + end_effector.name, series_color(arm));
  }
  for (const SceneBody& body : run.scene->bodies) {
    if (body.kind == "target")
      draw_path(stage, samples, RecordedPose(run.series, body.series), "path of " + body.name, kTargetColor);
  }
  if (const Series* com = find_series(run.series, "system/center_of_mass"); com != nullptr && com->width() == 3) {
    const std::size_t at = 3 * last;
    stage.begin("centre of mass of the system", fmt::format("using 1:2 with points pt 7 ps 0.75 lc rgb '#ffffff'"));
    stage.point(Vector3d{com->data[at], com->data[at + 1], com->data[at + 2]});
    stage.again(fmt::format("using 1:2 with points pt 6 ps 0.75 lw 0.9 lc rgb '{}'", kInk));
    stage.again(fmt::format("using 1:2 with points pt 1 ps 0.75 lw 0.9 lc rgb '{}'", kInk));
    panel.items.push_back(
        {-1, "", "centre of mass", {LegendSample::Kind::point, fmt::format("pt 1 ps 0.75 lw 0.9 lc rgb '{}'", kInk)}});
  }
  panel.items.push_back(
      {-1, "", "paths", {LegendSample::Kind::line, fmt::format("lc rgb '{}' dt (5,3) lw 0.8", kMuted)}});
}

// A phase => its panel of the figure; `box` grows by what is drawn.
void draw_panel(Figure& figure, Box& box, const Strobe& strobe, const FigureRequest& request,
                const std::string& phase) {
  const auto& [run, actors, view, planar] = strobe;
  FigureRequest part = request;
  part.phases = {phase};
  std::vector<std::size_t> samples = samples_shown(run.series, part);
  const std::vector<std::size_t> instants = instants_of(run.series, samples, request);
  if (instants.empty()) return;
  FigurePanel panel;
  panel.title = phase_title(phase);
  panel.legend = true;
  if (view.right_name.empty()) {
    panel.bare = true;
  } else {
    panel.x_label = view.right_name + " [m]", panel.y_label = view.up_name + " [m]";
  }
  Stage stage(figure, panel, box, view);
  samples.erase(std::remove_if(samples.begin(), samples.end(), [&](std::size_t i) { return i > instants.back(); }),
                samples.end());

  draw_obstacles(figure, panel, run, view);
  for (std::size_t k = 0; k < instants.size(); ++k) {
    const double strength =
        instants.size() == 1 ? 1 : std::pow(static_cast<double>(k) / static_cast<double>(instants.size() - 1), 1.3);
    const double time = run.series.time[instants[k]];
    draw_instant(stage, actors, instants[k], time, strength, planar);
    panel.items.push_back({-1,
                           "",
                           fmt::format("{:.5g} s", time),
                           {LegendSample::Kind::box,
                            fmt::format("fc rgb '{}' fs solid noborder", lightened(kInk, 0.15 + 0.6 * strength))}});
  }
  draw_paths(stage, panel, run, samples, instants.back());
  figure.panels.push_back(std::move(panel));
}

double nice_length(double longest) {
  const double decade = std::pow(10, std::floor(std::log10(longest)));
  for (const double f : {5.0, 2.0, 1.0}) {
    if (f * decade <= longest) return f * decade;
  }
  return decade;
}

// A scale and the directions of W's axes for drawings without axes, in a strip below the drawing.
void add_scale(Figure& figure, FigurePanel& panel, const Box& box, const View& view) {
  const double width = box.size(0), length = nice_length(0.3 * width), arm = 0.07 * width;
  const double x = box.low[0] + 0.01 * width, y = box.low[1] - 0.09 * width;
  FigureBlock scale;
  scale.about = "scale";
  scale.rows = {{x, y}, {x + length, y}};
  figure.blocks.push_back(scale);
  panel.items.push_back(
      {static_cast<int>(figure.blocks.size()) - 1, fmt::format("using 1:2 with lines lw 1.6 lc rgb '{}'", kInk), ""});
  panel.labels.push_back(
      {fmt::format("{:g} m", length),
       fmt::format("at first {:.8g}, first {:.8g} center offset 0,0.6 font ',7'", x + length / 2, y)});
  FigureBlock axes;
  axes.about = "axes of W";
  const double ox = box.high[0] - 1.3 * arm, oy = y;
  for (int k = 0; k < 3; ++k) {
    const Point2 tip = view(Vector3d::unit(k));
    axes.rows.push_back({ox, oy, arm * tip[0], arm * tip[1]});
    panel.labels.push_back({std::string(1, "xyz"[k]), fmt::format("at first {:.8g}, first {:.8g} center font ',7'",
                                                                  ox + 1.35 * arm * tip[0], oy + 1.35 * arm * tip[1])});
  }
  figure.blocks.push_back(axes);
  panel.items.push_back(
      {static_cast<int>(figure.blocks.size()) - 1,
       fmt::format("using 1:2:3:4 with vectors head filled size graph 0.012,20 lw 0.9 lc rgb '{}'", kInk), ""});
}

}  // namespace

Figure strobe_figure(const RunSource& run, const FigureRequest& request) {
  if (!run.scene)
    throw std::runtime_error((run.folder / "scene.json").string() +
                             ": missing, but required for the bodies' shapes; run the scenario again");
  const bool planar = run.scene->planar;
  const View view = view_along(planar ? "z" : request.view);
  const Strobe strobe{run, actors_of(run), view, planar};
  Figure figure;
  figure.what = request.what;
  figure.heads = figure_heads(run, request);
  Box box;
  for (const std::string& phase : phases_of(run.series, request)) draw_panel(figure, box, strobe, request, phase);
  if (figure.panels.empty())
    throw std::runtime_error(fmt::format("no instant is in the requested range; the run spans {:g} to {:g} s",
                                         run.series.time.front(), run.series.time.back()));
  if (view.right_name.empty()) {
    for (FigurePanel& panel : figure.panels) add_scale(figure, panel, box, view);
    box.low[1] -= 0.16 * box.size(0);
  }
  const double margin = kMargin * std::max(box.size(0), box.size(1));
  for (FigurePanel& panel : figure.panels) {
    panel.x_range = {box.low[0] - margin, box.high[0] + margin};
    panel.y_range = {box.low[1] - margin, box.high[1] + margin};
  }
  figure.columns = static_cast<int>(figure.panels.size());
  figure.width = request.width > 0 ? request.width : figure.columns > 1 ? 17.8 : 8.8;
  figure.height = request.height;
  figure.aspect = (box.size(1) + 2 * margin) / (box.size(0) + 2 * margin);
  figure.equal_axes = true;
  return figure;
}

}  // namespace grapnel
