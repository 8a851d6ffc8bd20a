#pragma once

/// @file
/// Matrices over velocities of a model some of whose joints move by the modes of a chain (ModalJoint). With Pi the
/// orthogonal projection onto the velocities that such a model can have, the identity for all other joints, J Pi and
/// Pi M Pi + alpha (1 - Pi), alpha > 0, in place of J and M give every velocity, impulse, energy and inverse inertia of
/// the model with its modes as coordinates, and nothing that depends on alpha: both parts of the mass matrix are
/// inverted apart, and no force reaches the second. Docs/theory, (22.15). point_jacobian() and mass_matrix() return
/// these, so that nothing that is built on them knows of modes.

#include <Eigen/Core>

#include "grapnel/model/tree.hpp"

namespace grapnel {

/// A <- A Pi, columns over velocities.
void project_columns(const Tree<double>& tree, Eigen::Ref<Eigen::MatrixXd> A);
/// M <- Pi M Pi + alpha (1 - Pi), alpha the mean of M's diagonal over the chain's joints.
void project_mass_matrix(const Tree<double>& tree, Eigen::Ref<Eigen::MatrixXd> M);

}  // namespace grapnel
