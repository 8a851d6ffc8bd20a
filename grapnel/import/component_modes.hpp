#pragma once

/// @file
/// Converts the matrices of a free finite-element model to the data of a flexible body in a robot file: mass, centre of
/// mass, inertia, and modes clamped at an interface with their participations; (22.11) to (22.14) of docs/theory.

#include <optional>
#include <vector>

#include "grapnel/import/element_matrix.hpp"
#include "grapnel/model/description.hpp"

namespace grapnel {

/// The part of the model that moves with the frame of the link or panel. Axes are those of the model.
struct ElementInterface {
  /// Rows of the six motions of the interface, translations along x, y, z, then rotations about them, from 0; for
  /// matrices without row names.
  std::vector<int> rows;
  /// A node with all six components; it is the frame's origin. For matrices with row names.
  std::optional<long long> node = {};
  /// Or nodes that are rigidly connected to the origin, with positions relative to it, in the model's unit.
  std::vector<NodePlace> nodes = {};
  /// Positions of further nodes, relative to the same origin, outside the interface: they locate expanded shells and
  /// beams.
  std::vector<NodePlace> others = {};
};

/// A model's units, in SI units.
struct ElementUnits {
  double length = 1;  // [m]
  double mass = 1;    // [kg]; time is in seconds
};

struct ComponentModeSettings {
  int modes = 20;      // maximum number
  double below = 100;  // [Hz]
  double damping_ratio = 0;
};

/// In SI, about the interface's origin.
struct ComponentModes {
  int degrees_of_freedom = 0;  // of the model, including the interface
  double mass = 0;
  Vector3d com = Vector3d::zero();
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass
  std::vector<VibrationMode> modes;           // slowest first
  int without_participation = 0;              // omitted modes in the range that cannot be excited through the interface
  // frequency of the first mode omitted because of `modes` or `below`, if computed [Hz]
  std::optional<double> next = {};
  double grounding = 0;  // frequency of the whole model on its own stiffness: 0 up to rounding [Hz]
};

/// Fixed-interface modes of Craig and Bampton (1968). Empty after an error: matrices that do not match each other or
/// the interface, that are indefinite, or a model that is supported or not connected.
std::optional<ComponentModes> component_modes(ElementMatrix mass, ElementMatrix stiffness,
                                              const ElementInterface& interface, const ElementUnits& units,
                                              const ComponentModeSettings& settings, FaultList& faults);

}  // namespace grapnel
