#pragma once

/// @file
/// From the matrices of a free finite-element model to what a robot file states of a body that vibrates: mass, centre
/// of mass, inertia, and modes clamped at an interface with their participations; (22.11) to (22.14) of docs/theory.

#include <optional>
#include <vector>

#include "grapnel/finite_elements/element_matrix.hpp"
#include "grapnel/model/description.hpp"

namespace grapnel {

/// What moves as one with the frame of the link or panel. Axes are those of the model.
struct ElementInterface {
  /// Rows of the six motions of the interface, translations along x, y, z, then rotations about them, from 0; where the
  /// matrices do not name their rows.
  std::vector<int> rows;
  /// A node with all six components; it is the frame's origin. Where the matrices name their rows.
  std::optional<long long> node = {};
  /// Or nodes that are tied rigidly to the origin, from which their places are measured, in the model's unit.
  std::vector<NodePlace> nodes = {};
  /// Places of more nodes, measured likewise, which are not tied: they help to find those of expanded shells and beams.
  std::vector<NodePlace> others = {};
};

/// A model's own units, in those of SI.
struct ElementUnits {
  double length = 1;  // [m]
  double mass = 1;    // [kg]; time is in seconds
};

struct ComponentModeSettings {
  int modes = 20;      // at most
  double below = 100;  // [Hz]
  double damping_ratio = 0;
};

/// In SI, about the interface's origin.
struct ComponentModes {
  int degrees_of_freedom = 0;  // of the model, those at the interface included
  double mass = 0;
  Vector3d com = Vector3d::zero();
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass
  std::vector<VibrationMode> modes;           // slowest first
  int without_participation = 0;              // modes in the range that nothing excites through the interface, left out
  std::optional<double> next = {};  // frequency of the first mode that `modes` or `below` leave out, if looked for [Hz]
  double grounding = 0;  // frequency at which the model's stiffness would hold it as a whole: 0 but for rounding [Hz]
};

/// Craig and Bampton's fixed-interface modes (1968). Empty after a fault: matrices that do not go with each other or
/// with the interface, that are indefinite, a model that is held elsewhere or that falls apart.
std::optional<ComponentModes> component_modes(ElementMatrix mass, ElementMatrix stiffness,
                                              const ElementInterface& interface, const ElementUnits& units,
                                              const ComponentModeSettings& settings, FaultList& faults);

}  // namespace grapnel
