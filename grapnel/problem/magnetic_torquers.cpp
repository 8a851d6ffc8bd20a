// Magnetic torquers: dipole moments of the base in the Earth's magnetic field (docs/theory, section 18, Magnetic
// torquers).
#include <stdexcept>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/simulate/base_effector.hpp"
#include "grapnel/simulate/magnetic_field.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"

namespace grapnel {
namespace {

// The array of the dipoles, as one of wheels whose torques are the dipoles: A u = m.
WheelArray array_of(const std::vector<MagneticTorquerSetup>& torquers) {
  std::vector<ReactionWheel> dipoles;
  for (const MagneticTorquerSetup& torquer : torquers) {
    ReactionWheel& dipole = dipoles.emplace_back();
    dipole.joint = dipole.velocity = static_cast<int>(dipoles.size()) - 1;
    dipole.axis = torquer.axis, dipole.torque = torquer.dipole;
  }
  return WheelArray(std::move(dipoles));
}

class MagneticTorquers final : public BaseEffector {
 public:
  MagneticTorquers(const std::vector<MagneticTorquerSetup>& torquers, const ReferenceOrbit& orbit,
                   const MagneticField& field)
      : array_(array_of(torquers)), orbit_(orbit), field_(field), values_(torquers.size() + 3, 0.0) {}

  std::string_view name() const override { return "magnetic_torquers"; }
  bool drives() const override { return true; }
  bool is_external() const override { return true; }
  std::string lane_obstacle() const override { return "magnetic torquers"; }

  void drive(const BaseMoment& at, const BaseCommand& command, std::span<double>, std::span<double> force) override {
    given_ = torque_for(at, command.torque);
    for (int k = 0; k < 3; ++k) force[at.v + k] = given_[k];
  }
  void add_beside(const BaseMoment& at, const Vector3d& torque, std::span<double>, std::span<double> beside) override {
    const Vector3d given = torque_for(at, torque);
    for (int k = 0; k < 3; ++k) beside[at.v + k] += given[k];
  }
  const Vector3d& given() const override { return given_; }
  std::span<const double> signals() const override { return values_; }

 private:
  // Commanded torque => dipoles for m = B x tau / |B|^2 by the minimum-norm allocation, all reduced in proportion where
  // one would exceed its maximum (18.8), and their torque m x B; all in the base's axes.
  Vector3d torque_for(const BaseMoment& at, const Vector3d& torque) {
    const Vector3d B = transposed_times(at.R_WB(), magnetic_field(field_, orbit_, at.time));
    const std::size_t count = array_.wheels().size();
    const std::span<double> dipoles = std::span(values_).first(count);
    array_.drive((-1 / dot(B, B)) * cross(B, torque), dipoles);
    for (int k = 0; k < 3; ++k) values_[count + static_cast<std::size_t>(k)] = B[k];
    return cross(-array_.torque_of(dipoles), B);
  }

  WheelArray array_;
  ReferenceOrbit orbit_;
  MagneticField field_;
  std::vector<double> values_;  // dipoles [A m^2], then the field in the base's axes [T]
  Vector3d given_ = Vector3d::zero();
};

std::string torquer_fault(const CaptureProblem& problem) {
  if (problem.robot.actuators.magnetic_torquers.empty())
    return "the robot has no magnetic torquers (actuators: {magnetic_torquers: [...]} in the robot file)";
  if (!problem.orbit || !problem.orbit->magnetic_field)
    return "magnetic torquers need the Earth's magnetic field: state orbit.magnetic_field";
  return {};
}

std::shared_ptr<BaseEffector> make_torquers(const CaptureProblem& problem) {
  if (const std::string why = torquer_fault(problem); !why.empty()) throw std::invalid_argument("base control: " + why);
  return std::make_shared<MagneticTorquers>(problem.robot.actuators.magnetic_torquers, reference_orbit(*problem.orbit),
                                            *problem.orbit->magnetic_field);
}

std::vector<ActuatorSignal> torquer_signals(const OtherActuators& actuators) {
  if (actuators.magnetic_torquers.empty()) return {};
  ActuatorSignal dipole{"magnetic_torquers/dipole", "A m^2", "dipole moments of the magnetic torquers", {}, {}};
  for (const MagneticTorquerSetup& torquer : actuators.magnetic_torquers) {
    dipole.components.push_back(torquer.name);
    dipole.limits.push_back(torquer.dipole);
  }
  return {dipole,
          {"magnetic_torquers/field",
           "T",
           "magnetic field while they are active, in the base's axes; else 0",
           {"x", "y", "z"},
           {}}};
}

}  // namespace

const OtherActuatorKind kMagneticTorquers{BaseActuatorKind::magnetic_torquers, torquer_fault, make_torquers,
                                          torquer_signals};

}  // namespace grapnel
