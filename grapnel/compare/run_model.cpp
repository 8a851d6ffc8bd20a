#include "grapnel/compare/run_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {
namespace {

// The texts of a run's scenario, placed where its scenario and robot would be files.
CaptureProblem stored_problem(const std::filesystem::path& folder, std::span<const Override> overrides) {
  const std::filesystem::path file = folder / "scenario.json";
  FaultList faults;
  const auto source = std::make_shared<const std::string>(file.string());
  const Mark whole{source, 0, 0};
  const auto refuse = [&](const std::string& why) {
    faults.add(whole, "the run's scenario cannot be restored: " + why + "; state its file with --scenario");
    faults.throw_if_any();
  };
  nlohmann::ordered_json document;
  try {
    document = read_json_document(file, "grapnel-scenario-texts/1");
  } catch (const std::exception& error) {
    refuse(error_text(error));
  }
  ScenarioFiles files;
  const std::filesystem::path scenario = folder / "scenario.yaml";
  std::vector<Override> all;
  std::string named_robot, other_robot;
  for (const auto& setting : document.value("settings", nlohmann::ordered_json::array())) {
    const std::string text = setting.get<std::string>();
    const std::size_t equal = text.find('=');
    if (equal == std::string::npos) continue;
    all.push_back({text.substr(0, equal), text.substr(equal + 1)});
    if (all.back().path == "robot") other_robot = all.back().value;
  }
  for (const auto& one : document.value("files", nlohmann::ordered_json::array())) {
    const std::string part = one.value("part", ""), text = one.value("text", "");
    const auto clean = checked_text(text, source, faults);
    if (text.empty() || !clean) refuse(fmt::format("it contains no text of the part '{}'", part));
    if (part == "scenario" || part == "robot") {
      auto tree = parse_document(*clean, source, faults);
      if (!tree) faults.throw_if_any();
      if (part == "scenario") {
        if (const Node* robot = tree->find("robot"); robot && robot->is_scalar()) named_robot = robot->text;
        if (tree->find("import")) refuse("it imports its robot");
        files.store(scenario, {text, {}, std::move(*tree)});
      } else {
        const std::string& named = other_robot.empty() ? named_robot : other_robot;
        if (!named.empty()) files.store(robot_path(scenario, named), {text, {}, std::move(*tree)});
      }
    } else if (!part.starts_with("target ")) {
      refuse(fmt::format("it has a part '{}'", part));
    }
  }
  if (!files.find(scenario)) refuse("it contains no scenario");
  all.insert(all.end(), overrides.begin(), overrides.end());
  const std::vector<Change> changes = changes_of(all, faults);
  faults.throw_if_any();
  return load_scenario(scenario, changes, files);
}

Vector3d vector_in(const nlohmann::ordered_json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != 3) return Vector3d::zero();
  Vector3d v = Vector3d::zero();
  for (int k = 0; k < 3; ++k) {
    const auto& number = (*found)[static_cast<std::size_t>(k)];
    v[k] = number.is_number() ? number.get<double>() : NAN;
  }
  return v;
}

std::vector<RunContact> contacts_of(const nlohmann::ordered_json& summary) {
  std::vector<RunContact> contacts;
  const auto add = [&](const nlohmann::ordered_json& impact) {
    if (!impact.is_object() || !impact.contains("grasps") || impact["grasps"].empty()) return;
    RunContact contact;
    contact.time = contact.end = impact.value("time", 0.0);
    for (const auto& grasp : impact["grasps"])
      contact.grasps.push_back({grasp.value("end_effector", ""), grasp.value("target", ""), vector_in(grasp, "impulse"),
                                vector_in(grasp, "angular_impulse")});
    for (const auto& held : impact.value("held_joints", nlohmann::ordered_json::array()))
      contact.held_joints.push_back(held.value("joint", ""));
    contacts.push_back(std::move(contact));
  };
  if (summary.contains("impact")) add(summary["impact"]);
  if (summary.contains("later_impacts")) {
    for (const auto& impact : summary["later_impacts"]) add(impact);
  }
  return contacts;
}

// Ends of compliant contacts: the last sample of the phase contact that begins then.
void find_ends(const TimeSeries& series, std::vector<RunContact>& contacts) {
  for (RunContact& contact : contacts) {
    const auto is_contact = [&](std::size_t k) {
      return series.phases[static_cast<std::size_t>(series.phase[k])].starts_with("contact");
    };
    for (std::size_t k = 0; k < series.time.size(); ++k) {
      if (!is_contact(k) || std::abs(series.time[k] - contact.time) > 1e-9 * (1 + contact.time)) continue;
      const int phase = series.phase[k];
      while (k < series.time.size() && series.phase[k] == phase) contact.end = std::max(contact.end, series.time[k++]);
      break;
    }
  }
}

[[noreturn]] void refuse_run(const std::filesystem::path& path, const std::string& why) {
  FaultList faults;
  faults.add({std::make_shared<const std::string>(path.string()), 0, 0}, why);
  faults.throw_if_any();
  throw std::logic_error("unreachable");
}

bool is_of_state(const std::string& path) {
  if (path == "joints/position" || path == "joints/velocity" || path == "wheels/rate") return true;
  if (!path.starts_with("base/") && !path.starts_with("targets/")) return false;
  const std::string name = path.substr(path.rfind('/') + 1);
  return name == "position" || name == "quaternion_wxyz" || name == "velocity" || name == "angular_velocity";
}

}  // namespace

RunModel::RunModel(const std::filesystem::path& run_folder, const std::filesystem::path& scenario,
                   std::span<const Override> overrides)
    : problem_(scenario.empty() ? stored_problem(run_folder, overrides) : load_scenario(scenario, overrides)),
      system_(make_capture_system(problem_)) {
  const std::filesystem::path summary = run_folder / "summary.json", file = run_folder / "timeseries.h5";
  if (!system_.gyros.empty()) refuse_run(summary, "impulses of robots with control moment gyros are not supported");
  if (is_flexible(problem_.robot) || !system_.model.springs().empty())
    refuse_run(summary, "impulses of flexible robots and targets are not supported: the deflections are not measured");
  try {
    contacts_ = contacts_of(read_json_document(summary, "grapnel-summary/2"));
    TimeSeries series;
    std::vector<std::size_t> needed;
    read_timeseries_blocks(
        file, std::numeric_limits<std::uint64_t>::max(),
        [&](const TimeSeriesHead& head) {
          series = head.names;
          for (std::size_t i = 0; i < series.series.size(); ++i) {
            if (is_of_state(series.series[i].path)) needed.push_back(i);
          }
        },
        [&](const TimeSeries& block) {
          series.time.insert(series.time.end(), block.time.begin(), block.time.end());
          series.phase.insert(series.phase.end(), block.phase.begin(), block.phase.end());
          for (const std::size_t i : needed) {
            std::vector<double>& all = series.series[i].data;
            all.insert(all.end(), block.series[i].data.begin(), block.series[i].data.end());
          }
        });
    find_ends(series, contacts_);
    if (series.time.empty()) refuse_run(file, "the run has no samples");
    begin_ = series.time.front(), end_ = series.time.back();
    for (const std::size_t i : needed) {
      const Series& one = series.series[i];
      curves_.emplace(one.path, RunCurve(series.time, one.data, static_cast<std::size_t>(one.width())));
      components_[one.path] = one.components;
    }
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    refuse_run(file, "cannot read the run: " + error_text(error));
  }
}

std::optional<PlacedFrame> RunModel::find_frame(const std::string& path) const {
  const auto of_frame = [&](int frame) {
    const Frame& f = model().frames()[static_cast<std::size_t>(frame)];
    return PlacedFrame{f.body, f.X_BE};
  };
  if (path == "base") return PlacedFrame{system_.base, Posed::identity()};
  const std::size_t slash = path.find('/');
  const std::string kind = path.substr(0, slash), name = slash == std::string::npos ? "" : path.substr(slash + 1);
  try {
    if (kind == "links") return PlacedFrame{model().body_index(name), Posed::identity()};
    if (kind == "end_effectors") return of_frame(model().frame_index(name));
  } catch (const std::out_of_range&) {
    return std::nullopt;
  }
  for (std::size_t t = 0; kind == "targets" && t < problem_.targets.size(); ++t) {
    if (problem_.targets[t].name == name) return of_frame(system_.target_frames[t]);
  }
  return std::nullopt;
}

std::optional<int> RunModel::find_joint(const std::string& series, const std::string& name) const {
  if (series.starts_with("wheels/")) {
    for (const int body : model().joints()) {
      if (model().bodies()[static_cast<std::size_t>(body)].description.name == wheel_body_name(name)) return body;
    }
    return std::nullopt;
  }
  for (const int j : system_.robot_joints) {
    const int body = model().joints()[static_cast<std::size_t>(j)];
    if (model().bodies()[static_cast<std::size_t>(body)].description.joint.name == name) return body;
  }
  return std::nullopt;
}

State RunModel::state_at(double time, bool before) const {
  State state = zero_state(model());
  const double at = before ? std::nextafter(time, -HUGE_VAL) : time;
  std::vector<double> out;
  const auto value = [&](const std::string& path) -> const std::vector<double>* {
    const auto found = curves_.find(path);
    if (found == curves_.end()) return nullptr;
    out.resize(found->second.width());
    found->second.value(std::clamp(at, begin_, end_), out);
    return std::all_of(out.begin(), out.end(), [](double x) { return std::isfinite(x); }) ? &out : nullptr;
  };
  const auto place = [&](const std::string& path, const PlacedFrame& frame) {
    Posed X_WF = Posed::identity();
    Twistd V_WF = Twistd::zero();
    if (const auto* p = value(path + "/position")) X_WF.p = {(*p)[0], (*p)[1], (*p)[2]};
    if (const auto* q = value(path + "/quaternion_wxyz")) {
      const double length = std::sqrt((*q)[0] * (*q)[0] + (*q)[1] * (*q)[1] + (*q)[2] * (*q)[2] + (*q)[3] * (*q)[3]);
      X_WF.R = rotation_matrix(Quaterniond{(*q)[0] / length, (*q)[1] / length, (*q)[2] / length, (*q)[3] / length});
    }
    if (const auto* w = value(path + "/angular_velocity")) V_WF.angular = {(*w)[0], (*w)[1], (*w)[2]};
    if (const auto* v = value(path + "/velocity")) V_WF.linear = {(*v)[0], (*v)[1], (*v)[2]};
    if (!model().has_free_root(frame.body)) return;
    const Posed X_WB = X_WF * inverse(frame.X_BF);
    set_root_pose(model(), frame.body, X_WB, state);
    set_root_twist(model(), frame.body, shift(V_WF, X_WB.p - X_WF.p), state);
  };
  place("base", {system_.base, Posed::identity()});
  for (const TargetSetup& target : problem_.targets) {
    const std::string path = "targets/" + target.name;
    place(path, *find_frame(path));
  }
  for (const char* path : {"joints/position", "joints/velocity", "wheels/rate"}) {
    const auto* values = value(path);
    if (!values) continue;
    for (std::size_t k = 0; k < values->size(); ++k) {
      const auto body = find_joint(path, components_.at(path)[k]);
      if (!body) continue;
      const Body& b = model().bodies()[static_cast<std::size_t>(*body)];
      (std::string_view(path) == "joints/position" ? state.q[static_cast<std::size_t>(b.q)]
                                                   : state.v[static_cast<std::size_t>(b.v)]) = (*values)[k];
    }
  }
  return state;
}

}  // namespace grapnel
