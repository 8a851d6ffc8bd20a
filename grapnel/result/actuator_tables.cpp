// Tables of actuators and driven joints.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/result/described_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table_parts.hpp"

namespace grapnel {
namespace {

std::string wheel_table(const CaptureResult& result) {
  if (result.wheels.empty()) return "";
  return "\nreaction wheels, relative to the base\n" +
         described_table(result.wheels,
                         "name = reaction wheel; rate_before; rate_after = after; largest_rate = largest; rate_limit = "
                         "limit; largest_torque; torque_limit = limit; momentum_after = momentum");
}

std::string gyro_table(const CaptureResult& result) {
  if (!result.gyros) return "";
  const GyrosReport& all = *result.gyros;
  std::string out = "\ncontrol moment gyros, relative to the base\n" +
                    described_table(all.each,
                                    "name = control moment gyro; momentum; angle_before; angle_after = after; "
                                    "largest_rate; rate_limit = limit; largest_torque; torque_limit = limit; "
                                    "largest_spin_torque = of rotor");
  out += fmt::format("minimum singularity measure {}", short_number(all.least_singularity_measure));
  if (all.steered)
    out += fmt::format(", near a singularity below {}; missing torque at most {} N m", short_number(all.near),
                       std::isnan(all.largest_torque_lacking) ? "-" : short_number(all.largest_torque_lacking));
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
  return "\n" + described_table(result.saturation,
                                "actuator = saturated; quantity; name; limit; duration = time; share%; first_time = "
                                "first at; at_end");
}

std::string joint_mode_table(const CaptureResult& result) {
  if (result.joints.empty()) return "";
  const auto mark = [](const JointReport& j) { return j.friction_determined ? "" : " *"; };
  std::string out = "\njoints with sticking friction, stops or motor models\n" +
                    described_table(result.joints,
                                    "joint; phase; mode = at its end; sticks; breakaways = breaks away; friction_heat; "
                                    "stop_impacts = stop hits; stop_energy_lost = stop loss; motor_work; "
                                    "electrical_energy = electrical",
                                    mark);
  if (std::ranges::any_of(result.joints, [](const JointReport& j) { return !j.friction_determined; }))
    out += paragraph(
        "* closed loops leave the friction of these joints undetermined while they are held: joint efforts and loads "
        "of the loops belong to the admissible friction with the minimum sum of squared shares of breakaway",
        "");
  return out;
}

std::string thruster_table(const CaptureResult& result) {
  if (!result.thrusters) return "";
  const ThrustersReport& all = *result.thrusters;
  std::string out = "\nthrusters: " + short_number(all.propellant) + " kg of propellant";
  if (!std::isnan(all.available)) out += " of " + short_number(all.available) + " kg available";
  if (all.excess() > 0) out += fmt::format(", EXCEEDS THE SUPPLY BY {} kg", short_number(all.excess()));
  out += "\n" + described_table(all.each, "name = thruster; firings; on_time = time on; duty%; impulse; propellant");
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
