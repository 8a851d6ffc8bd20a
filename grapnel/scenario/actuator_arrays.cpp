#include "grapnel/scenario/actuator_arrays.hpp"

#include <cmath>
#include <numbers>

#include "grapnel/scenario/sections.hpp"

namespace grapnel {

template <>
struct Described<ArrayConfiguration> : Enumeration<ArrayConfiguration, "ArrayConfiguration", "orthogonal", "pyramid"> {
};
template <>
struct Described<BaseAxis> : Enumeration<BaseAxis, "BaseAxis", "x", "y", "z"> {};

namespace {

template <class T>
constexpr Field configuration_key() {
  return found<[](T& t) -> ArrayConfiguration& {
           return t.layout.configuration;
         }>("configuration", "",
            "orthogonal: three, along the base's x, y and z. pyramid: four, whose axes (of gyros: their gimbals') have "
            "equal angles from one of these.")
      .required();
}
template <class T>
constexpr Field axis_key() {
  return found<[](T& t) -> BaseAxis& { return t.layout.axis; }>("axis", "",
                                                                "Axis of the base that is the pyramid's axis.");
}
template <class T>
constexpr Field skew_key() {
  return found<[](T& t) -> double& { return t.layout.skew; }>(
             "skew", "rad",
             "Angle of every axis from the pyramid's. At the default of 54.74 deg, acos(1/sqrt(3)), the array has the "
             "same capacity along x, y and z.")
      .above(0)
      .at_most(1.5)
      .by_default("0.9553166181245093");
}
template <class T>
constexpr Field azimuth_key() {
  return found<[](T& t) -> double& {
    return t.layout.azimuth;
  }>("azimuth", "rad",
     "The first axis leans towards the base's next one (from z towards x, from x towards y), rotated by this about the "
     "pyramid's axis; each is a quarter of a turn from the one before.");
}
// Described elsewhere.
constexpr Field friction_key() {
  Field f;
  f.key = "friction", f.text = "Of each bearing.", f.type = &joint_friction_description;
  f.show = [](const void* owner, ValueVisitor visitor) {
    visitor(&static_cast<const WheelArraySetup*>(owner)->each.friction);
  };
  f.place = [](void* owner) -> void* { return &static_cast<WheelArraySetup*>(owner)->each.friction; };
  return f;
}
constexpr auto kLayoutRules = std::to_array<Rule>({when("configuration", "orthogonal").forbid("axis, skew, azimuth")});

}  // namespace

template <>
struct Described<WheelArraySetup> {
  using T = WheelArraySetup;
  static constexpr auto fields = std::to_array<Field>({
      configuration_key<T>(),
      axis_key<T>(),
      skew_key<T>(),
      azimuth_key<T>(),
      found<[](T& t) -> std::string& { return t.each.name; }>("name", "", "Prefix of the wheels' names.")
          .by_default("\"wheel\""),
      found<[](T& t) -> double& { return t.each.inertia; }>("inertia", "kg m^2",
                                                            "Moment of inertia of each wheel about its axis.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.each.torque; }>("torque", "N m",
                                                           "Largest torque of each motor; absent: none.")
          .above(0)
          .as("number or infinity")
          .optional(),
      found<[](T& t) -> double& { return t.each.rate; }>("rate", "rad/s", "Largest rate of each wheel; absent: none.")
          .above(0)
          .up_to(1e+09)
          .plausible_to(kFastestRotor)
          .as("number or infinity")
          .optional(),
      friction_key(),
  });
  static constexpr Type type = structure<T>(
      "wheel_array", "Equal reaction wheels in a standard arrangement, in place of wheels.", fields, kLayoutRules);
};

template <>
struct Described<GyroArraySetup> {
  using T = GyroArraySetup;
  static constexpr auto fields = std::to_array<Field>({
      configuration_key<T>(),
      axis_key<T>(),
      skew_key<T>(),
      azimuth_key<T>(),
      found<[](T& t) -> std::string& { return t.each.name; }>("name", "", "Prefix of the gyros' names.")
          .by_default("\"gyro\""),
      found<[](T& t) -> double& { return t.each.inertia; }>("inertia", "kg m^2",
                                                            "Moment of inertia of each rotor about its axis.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.each.spin_rate; }>("spin_rate", "rad/s", "Rate of each rotor in its gimbal.")
          .above(0)
          .up_to(1e+09)
          .plausible_to(kFastestRotor)
          .required(),
      found<[](T& t) -> double& { return t.each.gimbal_inertia; }>(
          "gimbal_inertia", "kg m^2",
          "Moment of inertia about each gimbal's axis of all parts that turn with it; more than half of inertia.")
          .above(0)
          .required(),
      found<[](T& t) -> double& { return t.each.torque; }>("torque", "N m",
                                                           "Largest torque of each gimbal's motor; absent: none.")
          .above(0)
          .as("number or infinity")
          .optional(),
      found<[](T& t) -> double& { return t.each.rate; }>("rate", "rad/s",
                                                         "Largest commanded rate of each gimbal; absent: none.")
          .above(0)
          .up_to(1e+09)
          .as("number or infinity")
          .optional(),
      found<[](T& t) -> double& { return t.each.bandwidth; }>(
          "bandwidth", "1/s", "Bandwidth of the loops by which the motors control both rates.")
          .above(0)
          .up_to(1e+06)
          .by_default("20"),
  });
  static constexpr Type type = structure<T>(
      "gyro_array", "Equal control moment gyros in a standard arrangement, in place of gyros.", fields, kLayoutRules);
};

const Type& wheel_array_description() { return type_of<WheelArraySetup>(); }
const Type& gyro_array_description() { return type_of<GyroArraySetup>(); }

namespace {

// The axes of an array, and directions perpendicular to each: of a pyramid right-handed about its axis.
struct ArrayAxes {
  std::vector<Vector3d> along, across;
};

ArrayAxes axes_of(const ArrayLayout& layout) {
  ArrayAxes axes;
  if (layout.configuration == ArrayConfiguration::orthogonal) {
    for (int k = 0; k < 3; ++k) {
      axes.along.push_back(Vector3d::unit(k));
      axes.across.push_back(Vector3d::unit((k + 1) % 3));
    }
    return axes;
  }
  const int k = static_cast<int>(layout.axis);
  const Vector3d a = Vector3d::unit(k), first = Vector3d::unit((k + 1) % 3), second = Vector3d::unit((k + 2) % 3);
  // Of quarter turns exactly, so that opposite ones cancel.
  const double c = std::cos(layout.azimuth), s = std::sin(layout.azimuth);
  const Vector3d out = c * first + s * second, next = c * second - s * first;
  for (const Vector3d& radial : {out, next, -out, -next}) {
    axes.along.push_back(std::sin(layout.skew) * radial + std::cos(layout.skew) * a);
    axes.across.push_back(cross(a, radial));
  }
  return axes;
}

}  // namespace

std::vector<WheelSetup> wheels_of(const WheelArraySetup& array) {
  std::vector<WheelSetup> wheels;
  for (const Vector3d& axis : axes_of(array.layout).along) {
    WheelSetup& wheel = wheels.emplace_back(array.each);
    wheel.name += "-" + std::to_string(wheels.size()), wheel.axis = axis;
  }
  return wheels;
}

std::vector<MomentGyroSetup> gyros_of(const GyroArraySetup& array) {
  const ArrayAxes axes = axes_of(array.layout);
  std::vector<MomentGyroSetup> gyros;
  for (std::size_t i = 0; i < axes.along.size(); ++i) {
    MomentGyroSetup& gyro = gyros.emplace_back(array.each);
    gyro.name += "-" + std::to_string(i + 1), gyro.gimbal_axis = axes.along[i], gyro.spin_axis = axes.across[i];
  }
  return gyros;
}

}  // namespace grapnel
