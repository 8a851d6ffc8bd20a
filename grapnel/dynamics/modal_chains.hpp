#pragma once

/// @file
/// Matrices over the velocities of a model with modal joints (ModalJoint). Pi is the orthogonal projection onto the
/// velocities that such a model can have; it is the identity for all other joints. With J Pi and Pi M Pi + alpha (1 -
/// Pi), alpha > 0, in place of J and M, all velocities, impulses, energies and inverse inertias equal those in modal
/// coordinates. They are independent of alpha: both parts of the mass matrix are inverted separately, and no force acts
/// on the second. See (22.15) of docs/theory. point_jacobian() and mass_matrix() return these matrices, so their
/// callers need no special treatment of modes.

#include <Eigen/Core>

#include "grapnel/model/tree.hpp"

namespace grapnel {

/// A <- A Pi, columns over velocities.
void project_columns(const Tree<double>& tree, Eigen::Ref<Eigen::MatrixXd> A);
/// M <- Pi M Pi + alpha (1 - Pi), alpha the mean of M's diagonal over the chain's joints.
void project_mass_matrix(const Tree<double>& tree, Eigen::Ref<Eigen::MatrixXd> M);

}  // namespace grapnel
