#pragma once

/// @file
/// Identification of the mass, centre of mass and inertia of a held body from measured rates and the known part of the
/// total momentum (docs/theory, section 16). Thread safety: a pure function.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/dynamics/state.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// Standard deviations of the sensor noise: white, independent; none in attitudes and joint positions.
struct RateNoise {
  double angular_velocity = 0;  // of the base, per axis [rad/s]
  double velocity = 0;          // of the base, per axis [m/s]
  double joint_rate = 0;        // per joint velocity [rad/s or m/s]
};

/// A sensor reading.
struct MotionSample {
  State state;  // true poses and measured velocities
  /// External impulse on the tree since the first sample, about W's origin, in W; assumed known.
  Impulsed impulse = Impulsed::zero();
};

/// Measured quantities of the base's motion.
enum class MeasuredBase {
  twist,     // position, attitude, angular velocity and velocity
  rotation,  // attitude and angular velocity; position and velocity are not used, and no force may act
};

struct IdentificationTask {
  const Model& model;  // the masses of all bodies of the tree are known, except that of the held body
  int frame;           // of the model, on the held body: the parameters are expressed in this frame
  std::vector<MotionSample> samples;
  MeasuredBase base = MeasuredBase::twist;
  /// Total momentum of the tree at the first sample, in W; absent: unknown. Angular part: about W's origin if the
  /// base's twist is measured, otherwise about the tree's centre of mass (`linear` is not read then).
  std::optional<Momentumd> momentum = {};
  RateNoise noise = {};
};

/// Identifiability of a group of parameters. ratio_only: they depend on one unknown number; if it or one of them is
/// known, all are.
enum class Identified { determined, ratio_only, not_determined };

/// Mass, centre of mass (3), inertia about it (xx, yy, zz, xy, xz, yz).
inline constexpr int kInertialParameters = 10;
using InertialParameters = std::array<double, kInertialParameters>;

/// A change of the parameters without effect on any measurement: `parameter` by one unit and the others with it.
/// Expressed in mass, first moment (3) and inertia about the frame's origin (xx, yy, zz, xy, xz, yz).
struct UnseenChange {
  int parameter = 0;
  InertialParameters change{};
};

struct IdentifiedBody {
  bool converged = false;  // the iteration on weights and rates converged
  int iterations = 0;
  int rank = 0;          // of ten
  double condition = 0;  // ratio of the largest to the smallest significant singular value, columns scaled; 0: rank 0
  /// Root mean square of the weighted residuals: close to 1 if the noise is as stated. 0 if all equations are needed.
  double residual = 0;
  /// Empty if not determined. Mass [kg], centre of mass [m] and inertia about it [kg m^2], in the frame.
  std::array<std::optional<double>, kInertialParameters> value = {};
  std::array<std::optional<double>, kInertialParameters> deviation =
      {};  // standard deviations due to noise; empty without noise
  Identified mass = Identified::not_determined;
  Identified com = Identified::not_determined;
  Identified inertia = Identified::not_determined;
  std::vector<UnseenChange> unseen = {};  // basis of the null space of the measurements
  /// Why no physical body has these parameters; empty if one can have them, or if not all are determined.
  std::string impossible = {};
  bool all_determined() const { return rank == kInertialParameters; }
};

/// Estimates ten parameters by weighted least squares. @throws std::invalid_argument if there are no samples, the
/// frame's body is its tree's root or its tree is fixed to the world, a noise is negative or not finite, or with
/// MeasuredBase::rotation a force acts.
IdentifiedBody identify_target(const IdentificationTask& task);

/// Names of the parameters of IdentifiedBody::value, such as "com_x".
std::string_view inertial_parameter_name(int parameter);
/// Description of a null-space direction: "mass + 1 kg with first_moment_x + 0.3 kg m".
std::string unseen_text(const UnseenChange& unseen);

}  // namespace grapnel
