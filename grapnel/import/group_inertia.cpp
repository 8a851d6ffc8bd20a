#include <fmt/format.h>

#include <cmath>

#include "grapnel/import/assembly_steps.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr const char* kHowToRepair = "the option repair_inertia (--repair-inertia) uses the nearest possible tensor";
constexpr double kLargestInertia = 1e25;  // [kg m^2] as in robot files
constexpr double kThinnest = 1e-6;        // minimum second moment of a flat body, relative to the largest moment

std::string moments_text(const Symmetric3d& inertia) {
  const Vector3d v = principal_moments(inertia).values;
  return fmt::format("{:.6g}, {:.6g}, {:.6g} kg m^2", v[0], v[1], v[2]);
}
std::string tensor_text(const Symmetric3d& I) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}, {:.6g}, {:.6g}, {:.6g}]", I.xx, I.yy, I.zz, I.xy, I.xz, I.yz);
}
bool is_zero(const Symmetric3d& I) {
  return I.xx == 0 && I.yy == 0 && I.zz == 0 && I.xy == 0 && I.xz == 0 && I.yz == 0;
}
bool is_moderate(const Symmetric3d& I) {
  for (const double x : {I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}) {
    if (!(std::abs(x) <= kLargestInertia)) return false;
  }
  return true;
}

class GroupWeigher {
 public:
  GroupWeigher(const SourceModel& model, const ImportOptions& options, std::vector<ImportDecision>& decisions,
               FaultList& faults)
      : model_(model), options_(options), decisions_(decisions), faults_(faults) {}

  std::optional<SourceInertia> weigh(const LinkGroup& group) {
    RigidBodyInertiad total = RigidBodyInertiad::zero();
    std::optional<SourceInertia> single;
    std::vector<std::string> names;
    const std::size_t before = faults_.size();
    for (const GroupedLink& one : group.links) {
      const SourceLink& link = model_.links[one.link];
      const auto inertia = inertia_of(link);
      if (!inertia) continue;
      names.push_back(link.name);
      total += one.X_GL * RigidBodyInertiad::about_com(inertia->mass, inertia->com, inertia->inertia);
      single = inertia;
      single->com = one.X_GL * inertia->com;
      single->inertia = rotate(one.X_GL.R, inertia->inertia);
      // Unchanged values keep their digits.
      if (is_identity(one.X_GL)) single->com = inertia->com, single->inertia = inertia->inertia;
    }
    if (names.empty()) return {};
    if (names.size() > 1) {
      single = SourceInertia{group.mark, total.mass, total.com(), total.rotational_about_com()};
      decide(
          group.mark,
          fmt::format(
              "{} and the links fixed to it form one body: mass, centre of mass and inertia are those of {} together",
              in_quotes(group.name), some_of(names)),
          group.name);
    }
    if (faults_.size() == before) judge_whole(*single, group);
    return single;
  }

 private:
  void decide(const Mark& mark, std::string text, const std::string& about) {
    decisions_.push_back({mark, std::move(text), about});
  }

  // The contribution of a link to its group, in the link's frame; empty if it has no mass.
  std::optional<SourceInertia> inertia_of(const SourceLink& link) {
    if (!link.inertia) return {};
    SourceInertia inertia = *link.inertia;
    const std::string named = "link " + in_quotes(link.name);
    if (inertia.mass < 0) {
      faults_.add(inertia.mark, fmt::format("{} has a negative mass, {} kg", named, inertia.mass));
      return {};
    }
    if (!is_moderate(inertia.inertia)) {
      faults_.add(inertia.mark, fmt::format("{} has an inertia beyond {:g} kg m^2", named, kLargestInertia));
      return {};
    }
    if (inertia.mass == 0) {
      if (!is_zero(inertia.inertia))
        decide(inertia.mark, fmt::format("{} has an inertia but no mass: its inertia is omitted", named), link.name);
      return {};
    }
    if (const auto disc = disc_of_planar_inertia(inertia.inertia)) {
      const double I = principal_moments(inertia.inertia).values[2];
      decide(inertia.mark,
             fmt::format("{} has an inertia about one axis only, {:.6g} kg m^2, as in planar models: {:.6g} kg m^2 "
                         "about the other two is assumed, as for a thin disc; planar motion does not depend on it",
                         named, I, 0.5 * I),
             link.name);
      inertia.inertia = *disc;
    } else if (!is_possible_inertia(inertia.inertia)) {
      mend(inertia, named, link.name, 0);
    }
    return inertia;
  }

  // Replaces an impossible tensor, or reports it.
  void mend(SourceInertia& inertia, const std::string& named, const std::string& about, double flattest) {
    const Symmetric3d given = inertia.inertia;
    const Vector3d moments = principal_moments(given).values;
    const std::string what =
        flattest > 0 ? "which means a body without thickness"
        : moments[0] < 0
            ? "and one of them is negative, which is physically impossible"
            : "and the largest exceeds the sum of the others, which is physically impossible (triangle inequality)";
    if (!options_.repair_inertia) {
      faults_.add(inertia.mark, fmt::format("{} has the principal moments of inertia {}, {}; {}", named,
                                            moments_text(given), what, kHowToRepair));
      return;
    }
    inertia.inertia = nearest_possible_inertia(given, flattest);
    decide(inertia.mark,
           fmt::format("{} has the inertia {} with the principal moments {}, {}; the nearest possible tensor is used, "
                       "{} with {}",
                       named, tensor_text(given), moments_text(given), what, tensor_text(inertia.inertia),
                       moments_text(inertia.inertia)),
           about);
  }

  // Parts may be points and rods, but moving groups may not.
  void judge_whole(SourceInertia& inertia, const LinkGroup& group) {
    const std::string named = "link " + in_quotes(group.name);
    if (!is_moderate(inertia.inertia)) {
      faults_.add(inertia.mark, fmt::format("{} has an inertia beyond {:g} kg m^2", named, kLargestInertia));
    } else if (is_zero(inertia.inertia)) {
      faults_.add(
          inertia.mark,
          fmt::format("{} has a mass of {:.6g} kg but no inertia: add an inertia{}", named, inertia.mass,
                      group.joint < 0 ? std::string()
                                      : fmt::format(", or lock joint {}", in_quotes(model_.joints[group.joint].name))));
    } else if (!inertia_fault(inertia.inertia).empty()) {
      mend(inertia, named, group.name, kThinnest);
    }
  }

  const SourceModel& model_;
  const ImportOptions& options_;
  std::vector<ImportDecision>& decisions_;
  FaultList& faults_;
};

}  // namespace

std::optional<SourceInertia> weigh(const SourceModel& model, const LinkGroup& group, const ImportOptions& options,
                                   std::vector<ImportDecision>& decisions, FaultList& faults) {
  return GroupWeigher(model, options, decisions, faults).weigh(group);
}

}  // namespace grapnel
