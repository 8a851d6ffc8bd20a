#include "commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "grapnel/campaign/campaign_report.hpp"
#include "grapnel/campaign/optimization_report.hpp"
#include "grapnel/campaign/result_folder.hpp"
#include "grapnel/campaign/run_scenario.hpp"
#include "grapnel/campaign/sensitivities.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/capture/elastic_report.hpp"
#include "grapnel/compare/comparison_report.hpp"
#include "grapnel/compare/identification.hpp"
#include "grapnel/compare/identification_report.hpp"
#include "grapnel/compare/impulse_report.hpp"
#include "grapnel/compare/log_mapping.hpp"
#include "grapnel/compare/mcap_export.hpp"
#include "grapnel/describe/contract.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/linear/linear_model.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/report/gltf_export.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/series_export.hpp"
#include "grapnel/scenario/ready_made.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "terminal.hpp"
#include "watch.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// Prints all errors of the input file on stderr, one per line.
int bad_input(const InputError& error) {
  print_errors(error.faults());
  return kBadInput;
}

std::vector<std::string> messages_of(const std::vector<Fault>& warnings) {
  std::vector<std::string> messages;
  for (const Fault& doubt : warnings) messages.push_back(doubt.message);
  return messages;
}

std::vector<Override> parse_overrides(const std::vector<std::string>& arguments) {
  std::vector<Override> overrides;
  for (const std::string& a : arguments) overrides.push_back(parse_override(a));
  return overrides;
}

std::vector<std::string> kinds_of_results() {
  std::vector<std::string> kinds;
  for (const ResultContract& one : result_contracts()) kinds.emplace_back(one.kind);
  return kinds;
}

}  // namespace

int run(const RunOptions& options) {
  CaptureProblem problem;
  std::vector<Fault> warnings;
  try {
    problem = load_scenario(options.scenario, parse_overrides(options.overrides), &warnings);
  } catch (const InputError& error) {
    return bad_input(error);
  }
  if (!options.quiet) {
    to_stdout("grapnel {}, scenario {} (sha256 {})\n\n", GRAPNEL_VERSION, options.scenario.string(),
              problem.sha256.substr(0, 12));
    flush_stdout();
  }
  Terminal terminal;
  const std::optional<fs::path> made = results_folder(options.output, options.scenario, Outputs::run, terminal);
  if (!made || (!options.force && !holds_no_others(*made, problem.name, problem.sha256, terminal))) return kBadInput;
  print_errors(warnings);
  const StopSignal stop;
  const auto work = [&](Listener& listener) {
    return run_scenario(problem, options.scenario, *made,
                        {.quiet = options.quiet,
                         .no_report = options.no_report,
                         .margins = options.margins,
                         .warnings = messages_of(warnings),
                         .stop = stop.token()},
                        listener);
  };
  return code_of(watched(options.watch, {"run", problem.name, *made, stop.source()}, terminal, work));
}

int check(const fs::path& scenario, const std::vector<std::string>& overrides) {
  try {
    std::vector<Fault> warnings;
    const CaptureProblem problem = load_scenario(scenario, parse_overrides(overrides), &warnings);
    print_errors(warnings);
    to_stdout("{}: no errors{} ({}, sha256 {})\n", scenario.string(),
              warnings.empty() ? "" : fmt::format(", {} warning{}", warnings.size(), warnings.size() == 1 ? "" : "s"),
              problem.name, problem.sha256.substr(0, 12));
    return kDone;
  } catch (const InputError& error) {
    return bad_input(error);
  }
}

std::span<const ResultContract> result_contracts() {
  static constexpr ResultContract all[] = {
      {"summary", "summary", "Grapnel summary, version 2", &type_of<Summary>},
      {"scene", "scene", "Grapnel scene, version 1", &type_of<SceneDocument>},
      {"study-table", "study", "Grapnel study table, version 1", &type_of<SweepReport>},
      {"campaign-report", "campaign", "Grapnel campaign report, version 1", &type_of<CampaignReport>},
      {"optimization-result", "optimization", "Grapnel optimization result, version 1", &type_of<OptimizationReport>},
      {"log-comparison", "comparison", "Grapnel comparison with a log, version 1", &type_of<ComparisonReport>},
      {"log-impulses", "impulses", "Grapnel impulses from a log, version 1", &type_of<ImpulseReport>},
      {"identification-result", "identification", "Grapnel identification result, version 1",
       &type_of<FittedLogsReport>},
      {"linear-model", "linear-model", "Grapnel linear model, version 1", &type_of<LinearModel>},
      {"sensitivities", "sensitivities", "Grapnel sensitivities, version 1", &type_of<SensitivityReport>}};
  return all;
}

std::vector<std::string> schema_kinds() {
  std::vector<std::string> kinds{"scenario",     "robot",    "target",  "study",
                                 "optimization", "campaign", "mapping", "identification"};
  for (const std::string& kind : kinds_of_results()) kinds.push_back(kind);
  return kinds;
}

int print_schema(const SchemaOptions& options) {
  const std::string& kind = options.kind;
  const ResultContract* result = nullptr;
  for (const ResultContract& one : result_contracts()) {
    if (one.kind == kind) result = &one;
  }
  const bool is_other = !options.page.empty() || options.typescript;
  if (is_other && !result) {
    to_stderr("grapnel: error: --typescript and --page are for results: {}\n", fmt::join(kinds_of_results(), ", "));
    return kBadInput;
  }
  try {
    write_stdout(options.typescript         ? typescript_types(result->document(), kOriginOfTypes)
                 : !options.page.empty()    ? page_with_tables(file_bytes(options.page), result->document())
                 : result                   ? json_schema(result->document(), result->title)
                 : kind == "robot"          ? robot_schema()
                 : kind == "target"         ? target_schema()
                 : kind == "study"          ? study_schema()
                 : kind == "optimization"   ? optimization_schema()
                 : kind == "campaign"       ? campaign_schema()
                 : kind == "mapping"        ? mapping_schema()
                 : kind == "identification" ? identification_schema()
                                            : scenario_schema());
    return kDone;
  } catch (const std::runtime_error& error) {  // reading the page failed
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
}

int export_result(const fs::path& folder, const ExportOptions& options) {
  std::vector<fs::path> files;
  for (const auto& [requested, name] : {std::pair{options.csv, "timeseries.csv"},
                                        {options.mat, "timeseries.mat"},
                                        {options.mcap, "timeseries.mcap"},
                                        {options.glb, "capture.glb"}})
    if (requested) files.push_back(folder / name);
  note_results(folder);
  Terminal terminal;
  if (!may_write(files, terminal)) return kBadInput;
  try {
    if (options.csv) to_stdout("{}\n", export_csv(folder).string());
    if (options.mat) to_stdout("{}\n", export_mat(folder).string());
    if (options.mcap) to_stdout("{}\n", export_mcap(folder, GRAPNEL_VERSION).string());
    if (options.glb) to_stdout("{}\n", export_glb(folder, GRAPNEL_VERSION).string());
    return kDone;
  } catch (const CannotWrite& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  } catch (const std::exception& error) {  // reading the scenario failed
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kBadInput;
  }
}

namespace {

// Mass properties of the whole robot at zero joint positions, about its centre of mass, in base axes.
RigidBodyInertiad composite(const Model& model, const Kinematics& k) {
  RigidBodyInertiad total = RigidBodyInertiad::zero();
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    total += shift_origin(world_inertia(model, k, static_cast<int>(i)), k.X_WB[i].p);
  }
  return total;
}

// Upper bound of the distance of an end-effector from the root of its arm on the base: the sum of the distances between
// joints.
double reach(const Model& model, const Frame& frame) {
  double length = norm(frame.X_BE.p);
  for (int i = frame.body; model.bodies()[i].parent >= 0; i = model.bodies()[i].parent) {
    const Body& body = model.bodies()[i];
    const JointDescription& joint = body.description.joint;
    if (slides_along_axis(joint.type)) length += std::max(std::abs(joint.limits.lower), std::abs(joint.limits.upper));
    if (model.bodies()[body.parent].parent >= 0) length += norm(body.description.X_PF.p);
  }
  return length;
}

// Column width for these names: at least 22 characters, and two more than the longest name.
int column_width(const std::vector<std::string>& names) {
  std::size_t longest = 20;
  for (const std::string& name : names) {
    const auto begins_character = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; };
    longest = std::max(longest, static_cast<std::size_t>(std::count_if(name.begin(), name.end(), begins_character)));
  }
  return static_cast<int>(longest) + 2;
}

void print_bodies(const Model& model) {
  std::vector<std::string> bodies, joints;
  for (const Body& b : model.bodies()) {
    bodies.push_back(b.description.name);
    joints.push_back(b.parent < 0 ? "-" : b.description.joint.name);
  }
  const int of_body = column_width(bodies), of_joint = column_width(joints);
  to_stdout("\n{:<{}}{:<{}}{:<{}}{:<12}{:>12}\n", "body", of_body, "parent", of_body, "joint", of_joint, "type",
            "mass [kg]");
  for (const Body& b : model.bodies()) {
    to_stdout("{:<{}}{:<{}}{:<{}}{:<12}{:>12.6g}\n", b.description.name, of_body,
              b.parent < 0 ? "-" : model.bodies()[b.parent].description.name, of_body,
              b.parent < 0 ? "-" : b.description.joint.name, of_joint, traits_of(b.description.joint.type).name,
              b.description.mass);
  }
}

// Frequencies of flexible links, with all joints at zero.
void print_elastic(const CaptureProblem& problem) {
  const CaptureSystem system = make_moving_servicer(problem);
  State state = zero_state(system.model);
  for (const int body : system.model.springs()) {
    const Body& b = system.model.bodies()[body];
    state.q[b.q] = b.description.joint.spring->rest;
  }
  const ElasticReport report = elastic_report(system, state, "start", 0);
  to_stdout("\nvibrations at zero joint positions: {} springs, fastest {:.6g} Hz\n", report.springs, report.fastest);
  to_stdout("{:>6}{:>14}{:>14}{:>18}{:>10}   {}\n", "mode", "base held", "base free", "and joints free", "damping",
            "effective mass, inertia, base held");
  const auto known = [](double x) { return std::isnan(x) ? std::string("-") : fmt::format("{:.6g} Hz", x); };
  for (std::size_t i = 0; i < report.modes.size(); ++i) {
    const ElasticModeReport& m = report.modes[i];
    const Vector3d &mass = m.effective_mass, &inertia = m.effective_inertia;
    to_stdout("{:>6}{:>14}{:>14}{:>18}{:>10.4g}   [{:.4g}, {:.4g}, {:.4g}] kg, [{:.4g}, {:.4g}, {:.4g}] kg m^2\n",
              i + 1, known(m.held), known(m.braked), known(m.free), m.damping_ratio, mass[0], mass[1], mass[2],
              inertia[0], inertia[1], inertia[2]);
  }
}

std::string limit_text(double limit) { return std::isfinite(limit) ? fmt::format("{:.6g}", limit) : "none"; }
std::string vector_text(const Vector3d& v) { return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v[0], v[1], v[2]); }

void print_wheels(const RobotSetup& robot) {
  if (robot.wheels.empty()) return;
  to_stdout("\n{:<22}{:>16}{:>16}{:>16}{:>20}   {}\n", "reaction wheel", "inertia [kg m^2]", "torque [N m]",
            "rate [rad/s]", "momentum [N m s]", "axis");
  for (const WheelSetup& w : robot.wheels)
    to_stdout("{:<22}{:>16.6g}{:>16}{:>16}{:>20}   {}\n", w.name, w.inertia, limit_text(w.torque), limit_text(w.rate),
              limit_text(w.inertia * w.rate), vector_text(w.axis));
}

void print_gyros(const RobotSetup& robot) {
  if (robot.gyros.empty()) return;
  to_stdout("\n{:<22}{:>20}{:>16}{:>16}{:>16}   {:<24}{}\n", "control moment gyro", "momentum [N m s]", "spin [rad/s]",
            "torque [N m]", "rate [rad/s]", "gimbal axis", "spin axis");
  for (const MomentGyroSetup& g : robot.gyros)
    to_stdout("{:<22}{:>20.6g}{:>16.6g}{:>16}{:>16}   {:<24}{}\n", g.name, g.inertia * g.spin_rate, g.spin_rate,
              limit_text(g.torque), limit_text(g.rate), vector_text(g.gimbal_axis), vector_text(g.spin_axis));
}

void print_thrusters(const RobotSetup& robot) {
  if (robot.thrusters.empty()) return;
  to_stdout("\n{:<22}{:>12}{:>12}{:>20}   {:<28}{}\n", "thruster", "force [N]", "I_sp [s]", "min time on [s]",
            "position [m]", "direction of its force");
  for (const ThrusterSetup& t : robot.thrusters)
    to_stdout("{:<22}{:>12.6g}{:>12.6g}{:>20.6g}   {:<28}{}\n", t.name, t.force, t.specific_impulse, t.min_on_time,
              vector_text(t.position), vector_text(t.direction));
  to_stdout("propellant for the thrusters: {}\n",
            robot.propellant ? fmt::format("{:.6g} kg", *robot.propellant) : "not stated");
}

// Prints a target, read like that of a scenario in which it is at rest.
int print_target(const ReadyMade& ready_made) {
  const TargetSetup target = load_ready_made_target(ready_made.name);
  const Vector3d& c = target.com;
  const Symmetric3d& I = target.inertia;
  to_stdout("{}: {}\n", ready_made.name, ready_made.description());
  to_stdout("mass {:.6g} kg\n", target.mass);
  to_stdout("  centre of mass     [{:.6g}, {:.6g}, {:.6g}] m\n", c[0], c[1], c[2]);
  to_stdout("  inertia about it   xx {:.6g}, yy {:.6g}, zz {:.6g}, xy {:.6g}, xz {:.6g}, yz {:.6g} kg m^2\n", I.xx,
            I.yy, I.zz, I.xy, I.xz, I.yz);
  std::vector<std::string> names;
  for (const GraspPoint& point : target.grasp_points) names.push_back(point.name);
  const int of_name = column_width(names);
  to_stdout("\n{:<{}}position in its frame [m]\n", "grasp point", of_name);
  for (const GraspPoint& point : target.grasp_points) {
    const Vector3d& p = point.X_TG.p;
    to_stdout("{:<{}}[{:.6g}, {:.6g}, {:.6g}]\n", point.name, of_name, p[0], p[1], p[2]);
  }
  return kDone;
}

}  // namespace

int info(const std::filesystem::path& file) {
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown)) {
    if (const ReadyMade* target = find_ready_made(ReadyMade::Kind::targets, file.string()))
      return print_target(*target);
    const std::string name = file.string();
    if (is_ready_made_name(name) && !find_ready_made(ReadyMade::Kind::robots, name)) {
      to_stderr("grapnel: error: there is no file {}; {}; {}\n", in_quotes(name),
                no_ready_made(ReadyMade::Kind::targets, name), no_ready_made(ReadyMade::Kind::robots, name));
      return kBadInput;
    }
  }
  try {
    CaptureProblem problem;
    std::vector<Fault> warnings;
    problem.robot = load_robot(file, &warnings);
    print_errors(warnings);
    const CaptureSystem system = make_servicer(problem);
    const Model& model = system.model;
    const Kinematics k = forward_kinematics(model, zero_state(model));
    const RigidBodyInertiad total = composite(model, k);
    const Vector3d c = total.com();
    const Symmetric3d I = total.rotational_about_com();
    to_stdout("{}: {} bodies, {} joints, {} end-effectors\n", problem.robot.name, model.bodies().size(),
              model.joints().size(), model.frames().size());
    to_stdout("mass {:.6g} kg\n", total.mass);
    to_stdout("at zero joint positions, in the base frame:\n");
    to_stdout("  centre of mass     [{:.6g}, {:.6g}, {:.6g}] m\n", c[0], c[1], c[2]);
    to_stdout("  inertia about it   xx {:.6g}, yy {:.6g}, zz {:.6g}, xy {:.6g}, xz {:.6g}, yz {:.6g} kg m^2\n", I.xx,
              I.yy, I.zz, I.xy, I.xz, I.yz);
    print_bodies(model);
    std::vector<std::string> names, links;
    for (int f : system.end_effectors) {
      names.push_back(model.frames()[f].name);
      links.push_back(model.bodies()[model.frames()[f].body].description.name);
    }
    const int of_name = column_width(names), of_link = column_width(links);
    to_stdout("\n{:<{}}{:<{}}{:>12}   {}\n", "end-effector", of_name, "link", of_link, "reach [m]",
              "position at zero joints [m]");
    for (int f : system.end_effectors) {
      const Frame& frame = model.frames()[f];
      const Vector3d p = frame_pose(model, k, f).p;
      to_stdout("{:<{}}{:<{}}{:>12.6g}   [{:.6g}, {:.6g}, {:.6g}]\n", frame.name, of_name,
                model.bodies()[frame.body].description.name, of_link, reach(model, frame), p[0], p[1], p[2]);
    }
    to_stdout("reach: maximum distance from the arm's first joint\n");
    print_wheels(problem.robot);
    print_gyros(problem.robot);
    print_thrusters(problem.robot);
    if (is_flexible(problem.robot)) print_elastic(problem);
    return kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
  }
  return kBadInput;
}

}  // namespace grapnel::app
