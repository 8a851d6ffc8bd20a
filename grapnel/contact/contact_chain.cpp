#include "grapnel/contact/contact_chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace grapnel {
namespace {

Vector3d place_in_link(const ContactChain::Piece& piece, const Kinematics& kinematics, const Vector3d& p_WC) {
  const Posed& X_WB = kinematics.X_WB[piece.body];
  return piece.p_LB + transposed_times(X_WB.R, p_WC - X_WB.p);
}

// The piece whose part of the axis is nearest to a point, and the point's coordinate along the axis there.
std::pair<std::size_t, double> nearest_piece(const ContactChain& chain, const Kinematics& kinematics,
                                             const Vector3d& p_WC) {
  std::size_t nearest = 0;
  double along = 0, least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < chain.pieces.size(); ++i) {
    const Vector3d p = place_in_link(chain.pieces[i], kinematics, p_WC) - chain.point;
    const double s = dot(chain.axis, p);
    const double before = i == 0 ? 0 : std::max(0.0, chain.cuts[i - 1].at - s);
    const double behind = i == chain.cuts.size() ? 0 : std::max(0.0, s - chain.cuts[i].at);
    const double distance = std::hypot(norm(p - s * chain.axis), before + behind);
    if (distance < least) least = distance, nearest = i, along = s;
  }
  return {nearest, along};
}

// An orientation between two, by the mean of their quaternions.
Rotationd mean_orientation(const Rotationd& a, const Rotationd& b, double share) {
  const Quaterniond p = quaternion_from(a);
  Quaterniond q = quaternion_from(b);
  if (p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z < 0) q = {-q.w, -q.x, -q.y, -q.z};
  const double s = 1 - share;
  Quaterniond sum{s * p.w + share * q.w, s * p.x + share * q.x, s * p.y + share * q.y, s * p.z + share * q.z};
  const double size = std::sqrt(sum.w * sum.w + sum.x * sum.x + sum.y * sum.y + sum.z * sum.z);
  return rotation_matrix(Quaterniond{sum.w / size, sum.x / size, sum.y / size, sum.z / size});
}

}  // namespace

ChainMotion::Side ChainMotion::side_of(const ContactChain::Piece& piece, const Kinematics& kinematics,
                                       const Vector3d& p_WC, const Vector3d& v_WC) {
  const Posed& X_WB = kinematics.X_WB[piece.body];
  const Twistd at_C = shift(kinematics.V_WB[piece.body], p_WC - X_WB.p);
  return {piece.body, X_WB.R, at_C.angular, place_in_link(piece, kinematics, p_WC),
          transposed_times(X_WB.R, v_WC - at_C.linear)};
}

// The coordinate along the axis at a cut is the mean of those relative to both pieces; the share of the second one
// rises as a polynomial of the seventh degree, whose first three derivatives vanish at both ends.
ChainMotion::ChainMotion(const ContactChain& chain, const Kinematics& kinematics, const Vector3d& p_WC,
                         const Vector3d& v_WC)
    : p_WC_(p_WC), v_WC_(v_WC), axis_(chain.axis) {
  const auto [nearest, along] = nearest_piece(chain, kinematics, p_WC);
  const std::size_t last = chain.cuts.size();
  const double low = nearest == 0 ? -std::numeric_limits<double>::infinity() : chain.cuts[nearest - 1].at;
  const double high = nearest == last ? std::numeric_limits<double>::infinity() : chain.cuts[nearest].at;
  const std::size_t cut = along - low < high - along ? nearest - 1 : nearest;  // the nearer one
  if (cut >= last) {                                                           // there is none
    sides_[0] = side_of(chain.pieces[nearest], kinematics, p_WC, v_WC);
    R_WL_ = sides_[0].R_WB;
    return;
  }
  for (std::size_t i = 0; i < 2; ++i) sides_[i] = side_of(chain.pieces[cut + i], kinematics, p_WC, v_WC);
  const ContactChain::Cut& at = chain.cuts[cut];
  const double s = dot(axis_, 0.5 * (sides_[0].p + sides_[1].p) - chain.point);
  const double u = std::clamp(0.5 * (1 + (s - at.at) / at.half), 0.0, 1.0), rest = u * (1 - u);
  share_ = u * u * u * u * (35 - u * (84 - u * (70 - 20 * u)));
  slope_ = 70 * rest * rest * rest / at.half;
  if (!(slope_ > 0)) {
    if (u > 0.5) sides_[0] = sides_[1];
    sides_[1] = {}, share_ = slope_ = 0;
  }
  R_WL_ = share_ > 0 ? mean_orientation(sides_[0].R_WB, sides_[1].R_WB, share_) : sides_[0].R_WB;
}

MovingBody ChainMotion::link() const {
  const auto blend = [&](const Vector3d& a, const Vector3d& b) { return (1 - share_) * a + share_ * b; };
  const Vector3d p = blend(sides_[0].p, sides_[1].p);
  const double rate = 0.5 * slope_ * dot(axis_, sides_[0].rate + sides_[1].rate);  // of the share
  const Vector3d p_rate = blend(sides_[0].rate, sides_[1].rate) + rate * (sides_[1].p - sides_[0].p);
  const Vector3d from_C = -(R_WL_ * p), w = blend(sides_[0].w, sides_[1].w);
  return {{R_WL_, p_WC_ + from_C}, {w, v_WC_ - R_WL_ * p_rate + cross(w, from_C)}};
}

// The transpose of the velocities in link().
std::array<ChainMotion::Part, 2> ChainMotion::parts(const Wrenchd& on_sphere) const {
  const Vector3d force = transposed_times(R_WL_, on_sphere.linear);  // in L
  const Vector3d by_share = (0.5 * slope_ * dot(force, sides_[1].p - sides_[0].p)) * axis_;
  std::array<Part, 2> parts;
  for (std::size_t i = 0; i < 2; ++i) {
    const double share = i == 0 ? 1 - share_ : share_;
    parts[i] = {sides_[i].body, {share * on_sphere.angular, sides_[i].R_WB * (share * force + by_share)}};
  }
  return parts;
}

}  // namespace grapnel
