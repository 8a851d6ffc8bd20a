#pragma once

/// @file
/// Mass, centre of mass and inertia of a body that a robot holds, from measured rates and what is known of the total
/// momentum (docs/theory, section 16). Thread safety: a free function of its arguments.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// Standard deviations of what sensors add to every reading: white, independent of each other, none in attitudes and
/// joint positions.
struct RateNoise {
  double angular_velocity = 0;  // of the base, per axis [rad/s]
  double velocity = 0;          // of the base, per axis [m/s]
  double joint_rate = 0;        // per joint velocity [rad/s or m/s]
};

/// A reading of sensors.
struct MotionSample {
  State state;  // poses as they are, velocities as measured
  /// Impulse from outside on the tree since the first sample, about W's origin, in W. Known.
  Impulsed impulse = Impulsed::zero();
};

/// What is measured of the base's motion.
enum class MeasuredBase {
  twist,     // position, attitude, angular velocity and velocity
  rotation,  // attitude and angular velocity; where it is, and how fast it moves, is not used, and no force may act
};

struct IdentificationTask {
  const Model& model;  // the masses of all bodies of the held body's tree but its own are known
  int frame;           // of the model, on the held body: its parameters are looked for in this frame
  std::vector<MotionSample> samples;
  MeasuredBase base = MeasuredBase::twist;
  /// Total momentum of the tree at the first sample, in W; absent: not known. Its angular part: about W's origin where
  /// the base's twist is measured, else about the tree's centre of mass (`linear` is not read then).
  std::optional<Momentumd> momentum = {};
  RateNoise noise = {};
};

/// What can be said of a group of parameters. ratio_only: they depend on one number that is not known: with it, or one
/// of them, the others are.
enum class Identified { determined, ratio_only, not_determined };

/// Mass, centre of mass (3), inertia about it (xx, yy, zz, xy, xz, yz).
inline constexpr int kInertialParameters = 10;
using InertialParameters = std::array<double, kInertialParameters>;

/// A change of the parameters that no measurement shows: `parameter` by one unit and the others with it. In mass, first
/// moment (3) and inertia about the frame's origin (xx, yy, zz, xy, xz, yz).
struct UnseenChange {
  int parameter = 0;
  InertialParameters change{};
};

struct IdentifiedBody {
  bool converged = false;  // the iteration on weights and rates
  int iterations = 0;
  int rank = 0;          // of ten
  double condition = 0;  // largest over smallest singular value that counts, columns scaled; 0: rank 0
  /// Root of the mean square of the weighted residuals: near 1 if the noise is what is stated. 0 where all equations
  /// are needed.
  double residual = 0;
  /// Empty where not determined. Of mass [kg], centre of mass [m] and inertia about it [kg m^2] in the frame.
  std::array<std::optional<double>, kInertialParameters> value = {};
  std::array<std::optional<double>, kInertialParameters> deviation = {};  // standard; of noise, empty without it
  Identified mass = Identified::not_determined;
  Identified com = Identified::not_determined;
  Identified inertia = Identified::not_determined;
  std::vector<UnseenChange> unseen = {};  // as many as the rank lacks
  /// Why no body has these parameters; empty: one can have them, or not all are determined.
  std::string impossible = {};
  bool all_determined() const { return rank == kInertialParameters; }
};

/// Ten parameters by weighted least squares. @throws std::invalid_argument if there are no samples, the frame's body is
/// its tree's root or its tree is fixed to the world, a noise is negative or not finite, or with MeasuredBase::rotation
/// a force acts.
IdentifiedBody identify_target(const IdentificationTask& task);

/// Names of the parameters of IdentifiedBody::value, such as "com_x".
std::string_view inertial_parameter_name(int parameter);
/// In words, with what goes along: "mass + 1 kg with first_moment_x + 0.3 kg m".
std::string unseen_text(const UnseenChange& unseen);

}  // namespace grapnel
