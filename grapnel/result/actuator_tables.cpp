// Tables of actuators and driven joints.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table_parts.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

std::string wheel_table(const CaptureResult& result) {
  if (result.wheels.empty()) return "";
  TextTable table;
  table.row({"reaction wheel", "rate before", "after", "largest", "limit", "largest torque", "limit", "momentum"});
  table.row({"", "rad/s", "rad/s", "rad/s", "rad/s", "N m", "N m", "N m s"});
  const auto limit = [](double x) { return std::isfinite(x) ? short_number(x) : "none"; };
  for (const WheelReport& w : result.wheels) {
    table.row({w.name, short_number(w.rate_before), short_number(w.rate_after), short_number(w.largest_rate),
               limit(w.rate_limit), std::isnan(w.largest_torque) ? "-" : short_number(w.largest_torque),
               limit(w.torque_limit), short_number(w.momentum_after())});
  }
  return "\nreaction wheels, relative to the base\n" + table.text();
}

std::string gyro_table(const CaptureResult& result) {
  if (!result.gyros) return "";
  const GyrosReport& all = *result.gyros;
  TextTable table;
  table.row({"control moment gyro", "momentum", "angle before", "after", "largest rate", "limit", "largest torque",
             "limit", "of rotor"});
  table.row({"", "N m s", "rad", "rad", "rad/s", "rad/s", "N m", "N m", "N m"});
  const auto limit = [](double x) { return std::isfinite(x) ? short_number(x) : "none"; };
  const auto known = [](double x) { return std::isnan(x) ? "-" : short_number(x); };
  for (const GyroReport& g : all.each) {
    table.row({g.name, short_number(g.momentum), short_number(g.angle_before), short_number(g.angle_after),
               short_number(g.largest_rate), limit(g.rate_limit), known(g.largest_torque), limit(g.torque_limit),
               known(g.largest_spin_torque)});
  }
  std::string out = "\ncontrol moment gyros, relative to the base\n" + table.text();
  out += fmt::format("minimum singularity measure {}", short_number(all.least_singularity_measure));
  if (all.steered)
    out += fmt::format(", near a singularity below {}; missing torque at most {} N m", short_number(all.near),
                       known(all.largest_torque_lacking));
  out += "\n";
  for (const SingularityHazard& h : all.hazards)
    out += fmt::format("NEAR A SINGULARITY from t = {} s for {} s: measure {}, missing torque {} N m\n",
                       short_number(h.begin), short_number(h.duration()), short_number(h.least_measure),
                       short_number(h.largest_torque_lacking));
  return out;
}

// Of every actuator that saturated.
std::string saturation_table(const CaptureResult& result) {
  if (result.saturation.empty()) return "";
  TextTable table;
  table.row({"saturated", "quantity", "name", "limit", "time", "share", "first at", "at the end"});
  table.row({"", "", "", "rad/s, N m, N", "s", "%", "s", ""});
  for (const SaturationReport& s : result.saturation)
    table.row({name_of(s.actuator), name_of(s.quantity), s.name, short_number(s.limit), short_number(s.duration),
               fmt::format("{:.1f}", 100 * s.share), short_number(s.first_time), s.at_end ? "yes" : "no"});
  return "\n" + table.text();
}

std::string joint_mode_table(const CaptureResult& result) {
  if (result.joints.empty()) return "";
  TextTable table;
  table.row({"joint", "phase", "at its end", "sticks", "breaks away", "friction heat", "stop hits", "stop loss",
             "motor work", "electrical"});
  table.row({"", "", "", "", "", "J", "", "J", "J", "J"});
  bool determined = true;
  for (const JointReport& j : result.joints) {
    const auto electrical = j.electrical_energy();
    determined = determined && j.friction_determined;
    const std::string mode = std::string(name_of(j.mode)) + (j.friction_determined ? "" : " *");
    table.row({j.joint, j.phase, mode, std::to_string(j.sticks), std::to_string(j.breakaways),
               short_number(j.friction_heat), std::to_string(j.stop_impacts), short_number(j.stop_energy_lost),
               short_number(j.motor_work), electrical ? short_number(*electrical) : "-"});
  }
  std::string out = "\njoints with sticking friction, stops or motor models\n" + table.text();
  if (!determined)
    out += paragraph(
        "* closed loops leave the friction of these joints undetermined while they are held: joint efforts and loads "
        "of the loops belong to the admissible friction with the minimum sum of squared shares of breakaway",
        "");
  return out;
}

std::string thruster_table(const CaptureResult& result) {
  if (!result.thrusters) return "";
  const ThrustersReport& all = *result.thrusters;
  TextTable table;
  table.row({"thruster", "firings", "time on", "duty", "impulse", "propellant"});
  table.row({"", "", "s", "%", "N s", "kg"});
  for (const ThrusterReport& t : all.each)
    table.row({t.name, std::to_string(t.firings), short_number(t.on_time), fmt::format("{:.1f}", 100 * t.duty),
               short_number(t.impulse), short_number(t.propellant)});
  std::string out = "\nthrusters: " + short_number(all.propellant) + " kg of propellant";
  if (!std::isnan(all.available)) out += " of " + short_number(all.available) + " kg available";
  if (all.excess() > 0) out += fmt::format(", EXCEEDS THE SUPPLY BY {} kg", short_number(all.excess()));
  out += "\n" + table.text();
  if (const auto& d = all.dumping)
    out += fmt::format("wheel momentum unloaded {} time{}, for {} s{}\n", d->begun, d->begun == 1 ? "" : "s",
                       short_number(d->duration), d->active ? ", still active at the end" : "");
  for (const PlumeHazard& h : all.hazards)
    out += fmt::format("plume of {} on {}: {} s, first at t = {} s\n", h.thruster, h.body, short_number(h.duration),
                       short_number(h.first_time));
  return out;
}

}  // namespace

std::string actuator_tables(const CaptureResult& result) {
  return wheel_table(result) + gyro_table(result) + thruster_table(result) + saturation_table(result) +
         joint_mode_table(result);
}

}  // namespace grapnel
