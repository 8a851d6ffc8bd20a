#include "grapnel/report/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "grapnel/report/series_table.hpp"

namespace grapnel {
namespace {

using Panels = std::vector<SeriesPanel>;

struct Drawing {
  Panels panels;
  int columns = 1;
};

// One value per sample. Throws if a damaged file has given the series another width.
std::vector<double> component(const Series& series, std::size_t index) {
  if (index >= series.components.size())
    throw std::runtime_error(fmt::format("the time series '{}' have {} components", series.path, series.width()));
  std::vector<double> values;
  for (std::size_t i = index; i < series.data.size(); i += series.components.size()) values.push_back(series.data[i]);
  return values;
}

bool all_zero(const std::vector<double>& values) {
  for (const double v : values) {
    if (v != 0 && std::isfinite(v)) return false;
  }
  return true;
}

// A vector over time with its style.
struct Vectors {
  std::string title;
  std::array<std::vector<double>, 3> xyz;
  std::string color;
  int dash = 0;
  double width = 1.3;
};

Vectors vectors_of(const Series& series, const std::string& title, const std::string& color, int dash = 0,
                   double width = 1.3) {
  if (series.width() != 3) throw std::runtime_error("the time series '" + series.path + "' are not vectors");
  return {title, {component(series, 0), component(series, 1), component(series, 2)}, color, dash, width};
}

// A quantity with three components, and its curves.
struct VectorQuantity {
  std::string name, symbol, unit;
  std::vector<Vectors> vectors;
};

// One panel per component in `axes`.
Panels vector_panels(const VectorQuantity& of, const std::vector<int>& axes) {
  const auto& [quantity, symbol, unit, vectors] = of;
  Panels panels;
  for (const int k : axes) {
    SeriesPanel panel;
    panel.quantity = fmt::format("{} {}", quantity, "xyz"[k]);
    panel.unit = unit;
    panel.symbol = fmt::format("{}_{}", symbol, "xyz"[k]);
    panel.group = quantity;
    panel.legend = false;
    for (const Vectors& v : vectors)
      panel.curves.push_back({v.title, v.xyz[static_cast<std::size_t>(k)], v.color, v.dash, v.width});
    panels.push_back(std::move(panel));
  }
  return panels;
}

// Linear beside angular quantities: in the plane x, y and z below each other, in space two columns.
Drawing linear_and_angular(const RunSource& run, const VectorQuantity& linear, const VectorQuantity& angular) {
  Drawing drawing;
  const bool planar = is_planar(run);
  const std::vector<int> in_plane{0, 1}, about_z{2}, all{0, 1, 2};
  const Panels left = vector_panels(linear, planar ? in_plane : all);
  const Panels right = vector_panels(angular, planar ? about_z : all);
  if (planar) {
    drawing.panels = left;
    drawing.panels.insert(drawing.panels.end(), right.begin(), right.end());
  } else {
    drawing.columns = 2;
    for (std::size_t k = 0; k < 3; ++k) drawing.panels.push_back(left[k]), drawing.panels.push_back(right[k]);
  }
  for (int c = 0; c < drawing.columns; ++c) drawing.panels[static_cast<std::size_t>(c)].legend = true;
  return drawing;
}

const Series& wanted(const RunSource& run, const std::string& path) {
  const Series* found = find_series(run.series, path);
  if (found == nullptr) throw std::runtime_error("the run has not recorded '" + path + "'");
  return *found;
}

std::string color_of(std::size_t index) { return series_color(static_cast<int>(index)); }

bool has_sliding_joints(const RunSource& run) {
  if (!run.scene) return false;
  return std::any_of(run.scene->bodies.begin(), run.scene->bodies.end(),
                     [](const SceneBody& body) { return body.joint && body.joint->type == "prismatic"; });
}

// Joints of different arms have different dashes, joints at the same place of their arms the same colour.
SeriesPanel joint_panel(const RunSource& run, const std::string& path, const std::string& quantity) {
  const Series& series = wanted(run, path);
  const std::vector<ArmPlace> places = joint_places(run, series.components);
  SeriesPanel panel;
  panel.quantity = quantity;
  panel.unit = series.unit;
  if (has_sliding_joints(run)) panel.unit += panel.unit == "rad" ? ", m" : panel.unit == "rad/s" ? ", m/s" : ", N";
  for (std::size_t i = 0; i < series.components.size(); ++i) {
    const bool one_arm = places[i].arm == 0;
    const int around = std::max(places[i].joint, 0);
    panel.curves.push_back(
        {series.components[i], component(series, i), series_color(around), one_arm ? around / 8 : places[i].arm, 1.2});
  }
  return panel;
}

constexpr std::size_t kMostCurves = 8;  // that one panel shows clearly

// A panel per arm where all joints in one would be too many, else one panel.
Panels joint_panels(const RunSource& run, const std::string& path, const std::string& quantity) {
  const SeriesPanel whole = joint_panel(run, path, quantity);
  const std::vector<ArmPlace> places = joint_places(run, wanted(run, path).components);
  int arms = 0;
  for (const ArmPlace& place : places) arms = std::max(arms, place.arm + 1);
  if (whole.curves.size() <= kMostCurves || arms < 2) return {whole};
  Panels panels(static_cast<std::size_t>(arms), whole);
  for (int arm = 0; arm < arms; ++arm) {
    SeriesPanel& panel = panels[static_cast<std::size_t>(arm)];
    panel.quantity = fmt::format("{}, arm {}", quantity, arm + 1);
    panel.curves.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].arm != arm) continue;
      panel.curves.push_back(whole.curves[i]);
      panel.curves.back().dash = std::max(places[i].joint, 0) / 8;
    }
  }
  return panels;
}

// Quantities of joints below each other; arms beside each other where they have separate panels, in at most two
// columns. Legends are in the panels of the first quantity.
Drawing joint_drawing(const RunSource& run, const std::vector<std::pair<const char*, const char*>>& quantities) {
  Drawing drawing;
  for (const auto& [path, quantity] : quantities) {
    const Panels panels = joint_panels(run, path, quantity);
    if (panels.size() > 1) drawing.columns = 2;
    const bool first = drawing.panels.empty();
    for (const SeriesPanel& panel : panels) {
      drawing.panels.push_back(panel);
      drawing.panels.back().legend = first;
    }
  }
  return drawing;
}

Drawing joints(const RunSource& run) {
  return joint_drawing(run, {{"joints/position", "joint angle"}, {"joints/velocity", "joint rate"}});
}

// For a page with other quantities: all joints in one panel.
Drawing joints_together(const RunSource& run) {
  return {{joint_panel(run, "joints/position", "joint angle"), joint_panel(run, "joints/velocity", "joint rate")}, 1};
}

Drawing torques(const RunSource& run) {
  std::vector<std::pair<const char*, const char*>> quantities{{"joints/effort", "motor torque"}};
  if (find_series(run.series, "joints/friction") != nullptr && !all_zero(wanted(run, "joints/friction").data))
    quantities.emplace_back("joints/friction", "joint friction");
  return joint_drawing(run, quantities);
}

// The velocity of an end-effector's grasp point, or empty.
struct GraspPointMotion {
  bool known = false;
  Vectors linear, angular;
};

GraspPointMotion grasp_point_motion(const RunSource& run, const std::string& end_effector, const std::string& color) {
  GraspPointMotion motion;
  if (!run.scene) return motion;
  for (const SceneGrasp& grasp : run.scene->grasps) {
    if (grasp.end_effector != end_effector) continue;
    Vector3d point = Vector3d::zero();
    for (const SceneGraspPoint& p : run.scene->grasp_points) {
      if (p.target == grasp.target && p.name == grasp.grasp_point) point = p.position;
    }
    const std::string body = "targets/" + grasp.target;
    const RecordedPose pose(run.series, body);
    motion.angular =
        vectors_of(wanted(run, body + "/angular_velocity"), grasp.target + " (grasp point)", color, 1, 1.1);
    motion.linear = vectors_of(wanted(run, body + "/velocity"), motion.angular.title, color, 1, 1.1);
    for (std::size_t i = 0; i < run.series.time.size(); ++i) {
      const Vector3d w{motion.angular.xyz[0][i], motion.angular.xyz[1][i], motion.angular.xyz[2][i]};
      const Vector3d turning = cross(w, rotation_matrix(pose.quaternion(i)) * point);
      for (int k = 0; k < 3; ++k) motion.linear.xyz[static_cast<std::size_t>(k)][i] += turning[k];
    }
    motion.known = true;
    return motion;
  }
  return motion;
}

Drawing velocities(const RunSource& run) {
  std::vector<Vectors> linear, angular;
  const std::vector<std::string> names = names_in(run.series, "end_effectors", "velocity");
  if (names.empty()) throw std::runtime_error("the run has not recorded the velocity of any end-effector");
  for (std::size_t e = 0; e < names.size(); ++e) {
    const std::string path = "end_effectors/" + names[e];
    linear.push_back(vectors_of(wanted(run, path + "/velocity"), names[e], color_of(e)));
    angular.push_back(vectors_of(wanted(run, path + "/angular_velocity"), names[e], color_of(e)));
    const GraspPointMotion point = grasp_point_motion(run, names[e], color_of(e));
    if (!point.known) continue;
    linear.push_back(point.linear), angular.push_back(point.angular);
  }
  return linear_and_angular(run, {"velocity", "v", "m/s", linear}, {"angular velocity", "ω", "rad/s", angular});
}

Vectors difference(Vectors a, const Vectors& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < a.xyz[k].size(); ++i) a.xyz[k][i] -= b.xyz[k][i];
  }
  return a;
}

SeriesPanel distance_panel(const RunSource& run) {
  SeriesPanel panel;
  panel.quantity = "distance", panel.unit = "m";
  const std::vector<std::string> names = names_in(run.series, "grasps", "distance");
  if (names.empty()) throw std::runtime_error("the run has not recorded the distance of any grasp");
  for (std::size_t e = 0; e < names.size(); ++e)
    panel.curves.push_back({names[e], component(wanted(run, "grasps/" + names[e] + "/distance"), 0), color_of(e)});
  return panel;
}

Drawing relative(const RunSource& run) {
  std::vector<Vectors> linear, angular;
  const std::vector<std::string> names = names_in(run.series, "end_effectors", "velocity");
  for (std::size_t e = 0; e < names.size(); ++e) {
    const GraspPointMotion point = grasp_point_motion(run, names[e], color_of(e));
    if (!point.known) continue;
    const std::string path = "end_effectors/" + names[e];
    linear.push_back(difference(vectors_of(wanted(run, path + "/velocity"), names[e], color_of(e)), point.linear));
    angular.push_back(
        difference(vectors_of(wanted(run, path + "/angular_velocity"), names[e], color_of(e)), point.angular));
  }
  if (linear.empty()) throw std::runtime_error("relative motion needs grasps and the folder's scene.json");
  return linear_and_angular(run, {"relative velocity", "Δv", "m/s", linear},
                            {"relative angular velocity", "Δω", "rad/s", angular});
}

Drawing momentum(const RunSource& run) {
  std::vector<Vectors> linear, angular;
  const auto add = [&](const std::string& body, const std::string& title, const std::string& color, double width) {
    linear.push_back(vectors_of(wanted(run, body + "/linear_momentum"), title, color, 0, width));
    angular.push_back(vectors_of(wanted(run, body + "/angular_momentum"), title, color, 0, width));
  };
  add("robot", "robot", series_color(0), 1.3);
  const std::vector<std::string> targets = names_in(run.series, "targets", "linear_momentum");
  for (std::size_t t = 0; t < targets.size(); ++t)
    add("targets/" + targets[t], targets[t], series_color(static_cast<int>(t) + 1), 1.3);
  add("system", "total", kInk, 1.6);
  return linear_and_angular(run, {"momentum", "p", "N s", linear}, {"angular momentum", "L", "N m s", angular});
}

// Roll, pitch and yaw of a quaternion (rotations about fixed x, y, z).
std::array<double, 3> roll_pitch_yaw(const Quaterniond& q) {
  const Rotationd R = rotation_matrix(q);
  return {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)), std::atan2(R(1, 0), R(0, 0))};
}

// Angles without jumps by whole turns.
void unwrap(std::vector<double>& angles) {
  constexpr double kTurn = 2 * 3.14159265358979323846;
  double before = std::nan("");
  for (double& angle : angles) {
    if (!std::isfinite(angle)) continue;
    if (std::isfinite(before)) angle -= kTurn * std::round((angle - before) / kTurn);
    before = angle;
  }
}

Drawing base(const RunSource& run) {
  const bool planar = is_planar(run);
  const RecordedPose pose(run.series, "base");
  std::array<std::vector<double>, 3> angles;
  double steepest = 0;
  for (std::size_t i = 0; i < run.series.time.size(); ++i) {
    const std::array<double, 3> rpy = roll_pitch_yaw(pose.quaternion(i));
    for (std::size_t k = 0; k < 3; ++k) angles[k].push_back(rpy[k]);
    steepest = std::max(steepest, std::abs(rpy[1]));
  }
  SeriesPanel attitude, rate;
  attitude.quantity = "base attitude", attitude.unit = "rad";
  rate.quantity = "base rate", rate.unit = "rad/s";
  const Series& rates = wanted(run, "base/angular_velocity");
  if (planar) {
    unwrap(angles[2]);
    attitude.curves.push_back({"about z", angles[2], series_color(0)});
    rate.curves.push_back({"about z", component(rates, 2), series_color(0)});
    attitude.legend = rate.legend = false;
    attitude.quantity += " about z", rate.quantity += " about z";
    return {{attitude, rate}, 1};
  }
  if (steepest < 1.4) {
    const std::array<const char*, 3> names{"roll (x)", "pitch (y)", "yaw (z)"};
    for (std::size_t k = 0; k < 3; ++k) {
      unwrap(angles[k]);
      attitude.curves.push_back({names[k], angles[k], color_of(k)});
    }
  } else {  // near a pitch of a quarter turn the other two angles are undefined
    const Series& quaternion = wanted(run, "base/quaternion_wxyz");
    attitude.quantity = "base quaternion", attitude.unit = "1";
    for (std::size_t k = 0; k < 4; ++k)
      attitude.curves.push_back({std::string(1, "wxyz"[k]), component(quaternion, k), color_of(k == 0 ? 7 : k - 1)});
  }
  for (std::size_t k = 0; k < 3; ++k)
    rate.curves.push_back({std::string(1, "xyz"[k]), component(rates, k), color_of(k)});
  return {{attitude, rate}, 1};
}

Drawing energy(const RunSource& run) {
  SeriesPanel panel;
  panel.quantity = "energy, work", panel.unit = "J";
  const std::vector<std::pair<std::string, std::string>> all{{"system/kinetic_energy", "kinetic energy"},
                                                             {"system/motor_work", "work of the motors"},
                                                             {"system/friction_work", "work of friction"},
                                                             {"system/external_work", "external work"}};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Series* series = find_series(run.series, all[i].first);
    if (series == nullptr || (i > 0 && all_zero(series->data))) continue;
    panel.curves.push_back(
        {all[i].second, component(*series, 0), i == 0 ? kInk : series_color(static_cast<int>(i) - 1)});
  }
  if (panel.curves.empty()) throw std::runtime_error("the run has not recorded 'system/kinetic_energy'");
  return {{panel}, 1};
}

// Names of the grasps that close a loop.
std::vector<std::string> closing_grasps(const RunSource& run) {
  std::vector<std::string> names;
  for (const std::string& name : names_in(run.series, "loops", "position_defect")) {
    if (!all_zero(wanted(run, "loops/" + name + "/position_defect").data)) names.push_back(name);
  }
  return names;
}

Drawing loops(const RunSource& run) {
  Drawing drawing;
  const std::vector<std::string> names = closing_grasps(run);
  if (names.empty()) throw std::runtime_error("the run has no closed loops");
  const std::array<std::array<const char*, 4>, 2> kinds{
      {{"position_defect", "loop defect", "m", "loop_closure_position"},
       {"angle_defect", "loop defect", "rad", "loop_closure_angle"}}};
  for (const auto& [quantity, label, unit, ledger] : kinds) {
    SeriesPanel panel;
    panel.quantity = label, panel.unit = unit, panel.logarithmic = true;
    for (std::size_t e = 0; e < names.size(); ++e)
      panel.curves.push_back(
          {names[e], component(wanted(run, "loops/" + names[e] + "/" + quantity), 0), color_of(e), 0, 0.9});
    if (run.summary) {
      const nlohmann::ordered_json::json_pointer bound(fmt::format("/ledger/{}/bound", ledger));
      if (run.summary->contains(bound) && run.summary->at(bound).is_number())
        panel.bound = run.summary->at(bound).get<double>();
    }
    panel.legend = drawing.panels.empty();
    drawing.panels.push_back(std::move(panel));
  }
  return drawing;
}

Drawing forces(const RunSource& run) {
  std::vector<Vectors> force, moment;
  const std::vector<std::string> names = names_in(run.series, "grasps", "force");
  if (names.empty()) throw std::runtime_error("the run has not recorded the force of any grasp");
  for (std::size_t e = 0; e < names.size(); ++e) {
    force.push_back(vectors_of(wanted(run, "grasps/" + names[e] + "/force"), names[e], color_of(e)));
    moment.push_back(vectors_of(wanted(run, "grasps/" + names[e] + "/moment"), names[e], color_of(e)));
  }
  return linear_and_angular(run, {"grasp force", "F", "N", force}, {"grasp moment", "M", "N m", moment});
}

Drawing clearance(const RunSource& run) {
  SeriesPanel panel;
  panel.quantity = "clearance", panel.unit = "m";
  for (const Series& s : run.series.series) {
    if (s.path.compare(0, 9, "clearance") != 0 || s.unit != "m") continue;
    for (std::size_t k = 0; k < s.components.size(); ++k)
      panel.curves.push_back(
          {s.width() == 1 ? s.path : s.components[k], component(s, k), color_of(panel.curves.size())});
  }
  if (panel.curves.empty()) throw std::runtime_error("the run has not recorded clearance over time");
  return {{panel}, 1};
}

Drawing wheels(const RunSource& run) {
  SeriesPanel momentum, torque;
  momentum.quantity = "momentum of wheels", momentum.unit = "N m s";
  torque.quantity = "torque of motors", torque.unit = "N m";
  const Series &stored = wanted(run, "wheels/momentum"), &motors = wanted(run, "wheels/torque");
  for (int w = 0; w < static_cast<int>(stored.width()); ++w) {
    momentum.curves.push_back({stored.components[w], component(stored, w), color_of(w)});
    torque.curves.push_back({motors.components[w], component(motors, w), color_of(w)});
  }
  torque.legend = false;
  return {{momentum, torque}, 1};
}

Drawing gyros(const RunSource& run) {
  SeriesPanel angle, torque, measure;
  angle.quantity = "angle of gimbals", angle.unit = "rad";
  torque.quantity = "torque of gimbals' motors", torque.unit = "N m";
  measure.quantity = "singularity measure", measure.unit = "1";
  const Series &angles = wanted(run, "gyros/angle"), &motors = wanted(run, "gyros/torque");
  for (int g = 0; g < static_cast<int>(angles.width()); ++g) {
    angle.curves.push_back({angles.components[g], component(angles, g), color_of(g)});
    torque.curves.push_back({motors.components[g], component(motors, g), color_of(g)});
  }
  measure.curves.push_back({"array", component(wanted(run, "gyros/singularity_measure"), 0), color_of(0)});
  torque.legend = measure.legend = false;
  return {{angle, torque, measure}, 1};
}

Drawing thrusters(const RunSource& run) {
  SeriesPanel given, used;
  given.quantity = "impulse of thrusters", given.unit = "N s";
  used.quantity = "propellant", used.unit = "kg";
  // Impulses of firing thrusters. Forces at the samples would miss or lengthen pulses shorter than the interval.
  const Series& impulses = wanted(run, "thrusters/impulse");
  for (int i = 0; i < static_cast<int>(impulses.width()); ++i) {
    const std::vector<double> values = component(impulses, i);
    const bool fires = !values.empty() && values.back() > 0;
    if (fires) given.curves.push_back({impulses.components[i], values, color_of(given.curves.size())});
  }
  if (given.curves.empty()) given.curves.push_back({"none fires", component(impulses, 0), color_of(0)});
  used.curves.push_back({"used", component(wanted(run, "thrusters/propellant"), 0), color_of(0)});
  used.legend = false;
  return {{given, used}, 1};
}

// Pairs of bodies that touch: normal force and depth, and the impulse of hard contacts in an instant.
Drawing contacts(const RunSource& run) {
  SeriesPanel force, depth, impulse;
  force.quantity = "normal force", force.unit = "N";
  depth.quantity = "penetration", depth.unit = "m";
  impulse.quantity = "impulse of impacts", impulse.unit = "N s";
  const std::vector<std::string> pairs = names_in(run.series, "contacts", "normal_force");
  if (pairs.empty()) throw std::runtime_error("the run has no contacts between shapes");
  for (const std::string& pair : pairs) {
    const std::string group = "contacts/" + pair + "/";
    const Series &pressing = wanted(run, group + "normal_force"), &overlap = wanted(run, group + "depth");
    const Series* struck = find_series(run.series, group + "impact_impulse");
    const bool strikes = struck != nullptr && !all_zero(struck->data);
    if (all_zero(pressing.data) && !strikes) continue;
    const std::string color = color_of(force.curves.size());
    force.curves.push_back({pair, component(pressing, 0), color});
    depth.curves.push_back({pair, component(overlap, 0), color});
    if (strikes) impulse.curves.push_back({pair, component(*struck, 0), color});
  }
  if (force.curves.empty()) throw std::runtime_error("no bodies touch at a sample of the run");
  depth.legend = impulse.legend = false;
  Drawing drawing{{force, depth}, 1};
  if (!impulse.curves.empty()) drawing.panels.push_back(impulse);
  return drawing;
}

// A capture by contacts: how firmly each target is held, and how fast it still moves in the gripper.
Drawing grip(const RunSource& run) {
  constexpr std::array<std::array<const char*, 3>, 4> kQuantities{{{"grip_force", "grip force", "N"},
                                                                   {"friction_margin", "friction margin", "1"},
                                                                   {"speed", "relative speed", "m/s"},
                                                                   {"rate", "relative rate", "rad/s"}}};
  const std::vector<std::string> targets = names_in(run.series, "stages", "grip_force");
  if (targets.empty()) throw std::runtime_error("the run has no stages of a capture");
  Drawing drawing;
  for (const auto& [name, quantity, unit] : kQuantities) {
    SeriesPanel panel;
    panel.quantity = quantity, panel.unit = unit;
    for (std::size_t t = 0; t < targets.size(); ++t)
      panel.curves.push_back({targets[t], component(wanted(run, "stages/" + targets[t] + "/" + name), 0), color_of(t)});
    panel.legend = drawing.panels.empty();
    drawing.panels.push_back(std::move(panel));
  }
  return drawing;
}

// The panels of a drawing, or empty if the run has not recorded them.
void append(Drawing (*draw)(const RunSource&), const RunSource& run, std::size_t most, Panels& panels) {
  try {
    const Drawing drawing = draw(run);
    for (std::size_t i = 0; i < std::min(most, drawing.panels.size()); ++i) {
      panels.push_back(drawing.panels[i]);
      panels.back().legend = i == 0;
    }
  } catch (const std::runtime_error&) {
  }
}

// A capture on one page: positions, motion, and efforts. Two columns, row by row.
Drawing summary(const RunSource& run) {
  Drawing page;
  page.columns = 2;
  append([](const RunSource& r) { return Drawing{{distance_panel(r)}, 1}; }, run, 1, page.panels);
  append(energy, run, 1, page.panels);
  append(joints_together, run, 2, page.panels);
  append(base, run, 2, page.panels);
  append(
      [](const RunSource& r) {
        return Drawing{{joint_panel(r, "joints/effort", "motor torque")}, 1};
      },
      run, 1, page.panels);
  append(contacts, run, 1, page.panels);
  append(clearance, run, 1, page.panels);
  append(wheels, run, 1, page.panels);
  append(gyros, run, 1, page.panels);
  append(thrusters, run, 1, page.panels);
  append(loops, run, 1, page.panels);
  if (page.panels.empty()) throw std::runtime_error("the run has recorded no quantity of the summary figure");
  for (SeriesPanel& panel : page.panels) panel.legend = panel.curves.size() > 1;
  return page;
}

struct Kind {
  const char* what;
  const char* about;
  Drawing (*draw)(const RunSource&);
};

constexpr std::array<Kind, 17> kKinds{{
    {"summary",
     "a capture on one page: distances, energy, joints, base, efforts, contacts, clearance, actuators, loops", summary},
    {"joints", "joint angles and rates", joints},
    {"velocities", "velocities of end-effectors and of their grasp points", velocities},
    {"relative", "end-effectors' velocities minus those of their grasp points", relative},
    {"distance", "distance of end-effectors from their grasp points",
     [](const RunSource& run) {
       return Drawing{{distance_panel(run)}, 1};
     }},
    {"momentum", "linear and angular momentum of robot and targets, and in total", momentum},
    {"base", "attitude and rate of the base", base},
    {"energy", "kinetic energy and work", energy},
    {"loops", "defects of closed loops, on a logarithmic axis", loops},
    {"torques", "motor torques and joint friction", torques},
    {"forces", "forces and moments on the grasps", forces},
    {"contacts", "normal force and penetration of bodies that touch, and impulses of their impacts", contacts},
    {"grip", "grip force, margin of friction and motion of the target in the gripper", grip},
    {"clearance", "clearance of bodies", clearance},
    {"wheels", "momentum of reaction wheels and torque of their motors", wheels},
    {"gyros", "angles and torques of control moment gyros' gimbals, and the singularity measure of the array", gyros},
    {"thrusters", "impulse of thrusters that fire, and propellant used", thrusters},
}};

}  // namespace

std::vector<FigureOffer> series_offers(const RunSource& run) {
  std::vector<FigureOffer> offers;
  for (const Kind& kind : kKinds) {
    try {
      kind.draw(run);
      offers.push_back({kind.what, kind.about});
    } catch (const std::runtime_error&) {  // not recorded
    }
  }
  return offers;
}

Figure series_figure(const RunSource& run, const FigureRequest& request) {
  for (const Kind& kind : kKinds) {
    if (request.what != kind.what) continue;
    const Drawing drawing = kind.draw(run);
    return assemble(run, request, drawing.panels, drawing.columns);
  }
  throw std::runtime_error("no figure '" + request.what + "'");
}

}  // namespace grapnel
