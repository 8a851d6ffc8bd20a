#include "grapnel/import/assemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "grapnel/import/assembly_steps.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

constexpr double kLargestAngle = 1e4, kLargestRate = 1e9, kLargestEffort = 1e15;

class RobotAssembly {
 public:
  RobotAssembly(const SourceModel& model, const ImportOptions& options, FaultList& faults)
      : model_(model), options_(options), faults_(faults) {
    result_.decisions = model.decisions;
  }

  std::optional<ImportedRobot> assemble() {
    const std::size_t before = faults_.size();
    const auto tree = link_tree(model_, faults_);
    if (!tree) return {};
    tree_ = &*tree;
    const auto settled = settle_joints(model_, options_, result_.decisions, faults_);
    if (faults_.size() > before) return {};
    auto grouped = group_links(model_, *tree, settled, options_, result_.decisions, faults_);
    if (!grouped) return {};
    grouped_ = std::move(*grouped);

    result_.tree = mapping_node(Mark{model_.links[tree_->root].mark.source, 1, 1});
    put(result_.tree, "schema", text_node("grapnel-robot/1"));
    put(result_.tree, "name", text_node(model_.name.empty() ? options_.source.stem().string() : model_.name));
    wheels_ = wheels_of_joints(model_, *tree, grouped_, options_, result_.decisions, faults_);
    put(result_.tree, "base", base_node());
    add_wheels();
    Node links = sequence_node();
    for (std::size_t g = 1; g < grouped_.groups.size() && !faults_.full(); ++g)
      links.items.push_back(link_node(grouped_.groups[g]));
    if (!links.items.empty()) put(result_.tree, "links", std::move(links));
    add_end_effectors();
    if (faults_.size() > before) return {};
    write_comments();
    return std::move(result_);
  }

 private:
  void decide(const Mark& mark, std::string text, const std::string& about) {
    result_.decisions.push_back({mark, std::move(text), about});
  }

  // ---- Names ----

  // Results are stored under names.
  static std::string sound_name(std::string name) {
    std::replace(name.begin(), name.end(), '/', '_');
    if (name == "." || name == "..") name += "_";
    return name;
  }
  std::string name_for(const std::string& name, const Mark& mark, const char* kind) {
    const std::string sound = sound_name(name);
    if (printable_line(sound) != sound)
      faults_.add(mark, fmt::format("the name of {} {} has characters that cannot be printed", kind, in_quotes(name)));
    if (sound != name)
      decide(mark,
             fmt::format("{} {} is renamed to {}: results are stored under names", kind, in_quotes(name),
                         in_quotes(sound)),
             name);
    if (!names_[kind].insert(sound).second)
      faults_.add(mark, fmt::format("{} {} would be renamed to {}, which exists already", kind, in_quotes(name),
                                    in_quotes(sound)));
    return sound;
  }

  // ---- Bodies ----

  std::string joint_name(const LinkGroup& group) const { return in_quotes(model_.joints[group.joint].name); }

  static void put_inertia(Node& node, const SourceInertia& inertia) {
    put(node, "mass", number_node(inertia.mass, inertia.mark));
    if (norm(inertia.com) != 0) put(node, "com", vector_node_of(inertia.com, inertia.mark));
    const Symmetric3d& I = inertia.inertia;
    std::vector<double> components{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz};
    if (I.xy == 0 && I.xz == 0 && I.yz == 0) components.resize(3);
    for (double& c : components) c += 0.0;  // no -0
    put(node, "inertia", list_node(components, inertia.mark));
  }

  Node base_node() {
    const LinkGroup& group = grouped_.groups[0];
    Node node = mapping_node(group.mark);
    put(node, "name", text_node(base_name_ = name_for(group.name, group.mark, "link"), group.mark));
    body_names_.push_back(base_name_);
    const std::size_t before = faults_.size();
    if (const auto inertia = weigh(model_, group, options_, result_.decisions, faults_)) {
      put_inertia(node, *inertia);
    } else if (!options_.is_carried && faults_.size() == before) {
      const auto heavy = std::find_if(model_.links.begin(), model_.links.end(),
                                      [](const SourceLink& link) { return link.inertia && link.inertia->mass > 0; });
      const std::string other = heavy == model_.links.end() ? "" : ", such as " + in_quotes(heavy->name);
      faults_.add(options_.base.name.empty() ? group.mark : options_.base.mark,
                  fmt::format("the base, link {}{}, has no mass: mount the robot on a satellite (bus: FILE.yaml; --bus "
                              "FILE.yaml), or select another base (base: LINK; --base LINK){}",
                              in_quotes(group.name), group.links.size() > 1 ? " with what is fixed to it" : "", other));
    }
    put_shapes(node, group);
    return node;
  }

  Node link_node(const LinkGroup& group) {
    Node node = mapping_node(group.mark);
    body_names_.push_back(name_for(group.name, group.mark, "link"));
    put(node, "name", text_node(body_names_.back(), group.mark));
    put(node, "parent", text_node(body_names_[group.parent], group.mark));
    put(node, "joint", joint_node(group));
    const std::size_t before = faults_.size();
    if (const auto inertia = weigh(model_, group, options_, result_.decisions, faults_))
      put_inertia(node, *inertia);
    else if (faults_.size() == before)
      faults_.add(
          model_.joints[group.joint].mark,
          fmt::format("joint {} moves link {}, which has no mass{}: give it one, or lock the joint", joint_name(group),
                      in_quotes(group.name), group.links.size() > 1 ? " with what is fixed to it" : ""));
    put_shapes(node, group);
    return node;
  }

  void add_wheels() {
    if (wheels_.empty()) return;
    Node list = sequence_node();
    for (const WheelOfJoint& wheel : wheels_) {
      const SourceJoint& joint = model_.joints[wheel.joint];
      Node node = mapping_node(joint.mark);
      put(node, "name", text_node(name_for(joint.name, joint.mark, "wheel"), joint.mark));
      put(node, "axis", vector_node_of(wheel.axis, joint.mark));
      put(node, "inertia", number_node(wheel.inertia, joint.mark));
      if (joint.effort && *joint.effort > 0 && *joint.effort <= kLargestEffort)
        put(node, "torque", number_node(*joint.effort, joint.limit_mark));
      if (joint.rate && *joint.rate > 0 && *joint.rate <= kLargestRate)
        put(node, "rate", number_node(*joint.rate, joint.limit_mark));
      put_friction(node, joint);
      list.items.push_back(std::move(node));
    }
    put(result_.tree, "wheels", std::move(list));
  }

  static void put_friction(Node& node, const SourceJoint& joint) {
    Node friction = mapping_node(joint.mark);
    if (joint.viscous_friction != 0) put(friction, "viscous", number_node(joint.viscous_friction, joint.mark));
    if (joint.coulomb_friction != 0) put(friction, "coulomb", number_node(joint.coulomb_friction, joint.mark));
    if (!friction.entries.empty()) put(node, "friction", std::move(friction));
  }

  // ---- Joints ----

  Node joint_node(const LinkGroup& group) {
    const SourceJoint& joint = model_.joints[group.joint];
    const char* type = joint.kind == SourceJoint::Kind::prismatic    ? "prismatic"
                       : joint.kind == SourceJoint::Kind::continuous ? "continuous"
                                                                     : "revolute";
    Node node = mapping_node(joint.mark);
    put(node, "name", text_node(name_for(joint.name, joint.mark, "joint"), joint.mark));
    put(node, "type", text_node(type, joint.mark));
    put(node, "axis", vector_node_of(group.is_reversed ? -joint.axis : joint.axis, joint.mark));
    if (!is_identity(group.X_PF)) put(node, "origin", pose_node(group.X_PF, joint.mark));
    put_limits(node, joint);
    put_friction(node, joint);
    if (joint.rotor_inertia != 0) put(node, "rotor_inertia", number_node(joint.rotor_inertia, joint.mark));
    if (joint.gear_ratio != 1) put(node, "gear_ratio", number_node(joint.gear_ratio, joint.mark));
    if (joint.mimic) put(node, "mimic", mimic_node(*joint.mimic));
    return node;
  }

  static Node mimic_node(const SourceMimic& mimic) {
    Node node = mapping_node(mimic.mark);
    put(node, "joint", text_node(sound_name(mimic.joint), mimic.mark));
    if (mimic.multiplier != 1) put(node, "ratio", number_node(mimic.multiplier, mimic.mark));
    if (mimic.offset != 0) put(node, "offset", number_node(mimic.offset, mimic.mark));
    return node;
  }

  void put_limits(Node& node, const SourceJoint& joint) {
    Node limits = mapping_node(joint.limit_mark);
    const std::string named = "joint " + in_quotes(joint.name);
    if (joint.lower && joint.upper && *joint.lower > *joint.upper)
      faults_.add(joint.limit_mark,
                  fmt::format("{}: the lower limit {} is above the upper limit {}", named, *joint.lower, *joint.upper));
    const auto put_limit = [&](const char* key, const char* what, const std::optional<double>& value, double largest,
                               bool positive) {
      if (!value) return;
      if (positive && !(*value > 0)) {
        faults_.add(joint.limit_mark, fmt::format("{}: the {} is {}, must be greater than 0", named, what, *value));
      } else if (std::abs(*value) > largest) {
        decide(joint.limit_mark, fmt::format("{}: the {} {:g} means no limit", named, what, *value), joint.name);
      } else {
        put(limits, key, number_node(*value, joint.limit_mark));
      }
    };
    if (joint.kind != SourceJoint::Kind::continuous) {
      put_limit("lower", "lower limit", joint.lower, kLargestAngle, false);
      put_limit("upper", "upper limit", joint.upper, kLargestAngle, false);
    }
    put_limit("rate", "velocity limit", joint.rate, kLargestRate, true);
    put_limit("effort", "effort limit", joint.effort, kLargestEffort, true);
    if (!limits.entries.empty()) put(node, "limits", std::move(limits));
  }

  // ---- Shapes ----

  void put_shapes(Node& body, const LinkGroup& group) {
    Node shapes = sequence_node(group.mark);
    for (const GroupedLink& one : group.links) {
      const SourceLink& link = model_.links[one.link];
      if (one.link == grouped_.world) {
        if (!link.shapes.empty())
          decide(link.mark, "the shapes of link 'world' are omitted: they are not part of the robot", group.name);
        continue;
      }
      if (add_shapes(link, one.X_GL, false, shapes)) continue;
      if (!add_shapes(link, one.X_GL, true, shapes) && !link.shapes.empty())
        decide(link.mark, fmt::format("link {} has no supported shape", in_quotes(link.name)), link.name);
    }
    if (shapes.items.size() == 1) put(body, "geometry", std::move(shapes.items[0]));
    if (shapes.items.size() > 1) put(body, "geometry", std::move(shapes));
  }

  // The collision shapes of a link, or its visual shapes; false if none is supported.
  bool add_shapes(const SourceLink& link, const Posed& X_GL, bool visual, Node& shapes) {
    const std::size_t before = shapes.items.size();
    for (const SourceShape& shape : link.shapes) {
      if (shape.is_visual != visual) continue;
      std::string file;
      const std::string why_not = why_no_shape(shape, file);
      if (why_not.empty()) {
        shapes.items.push_back(shape_node(shape.shape, X_GL, file, shape.mark));
        continue;
      }
      decide(
          shape.mark,
          fmt::format("link {}: the {} shape {}is omitted, {}", in_quotes(link.name), visual ? "visual" : "collision",
                      shape.mesh_file.empty() ? "" : "'" + printable_line(shape.mesh_file) + "' ", why_not),
          link.name);
    }
    return shapes.items.size() > before;
  }

  // Why a shape is not supported; empty if it is, with the path of a mesh for the robot file.
  std::string why_no_shape(const SourceShape& shape, std::string& file) {
    constexpr double kSmallest = 1e-9, kLargest = 1e4;  // [m] as in robot files
    const Geometry& g = shape.shape;
    const bool is_mesh = g.shape == Geometry::Shape::mesh;
    const int sizes = g.shape == Geometry::Shape::sphere ? 1 : g.shape == Geometry::Shape::box || is_mesh ? 3 : 2;
    for (int k = 0; k < sizes; ++k) {
      if (is_mesh && g.size[k] < 0) return fmt::format("its scale {} mirrors it", g.size[k]);
      if (!(g.size[k] >= kSmallest && g.size[k] <= kLargest))
        return fmt::format("a {} of {} is not valid", is_mesh ? "scale" : "dimension", g.size[k]);
    }
    if (!is_mesh) return {};
    const auto it = found_.try_emplace(shape.mesh_file).first;
    if (it->second.file.empty() && it->second.why_not.empty()) it->second = find_mesh(shape.mesh_file, options_);
    if (!it->second.why_not.empty()) return it->second.why_not;
    std::error_code error;
    const auto place = std::filesystem::absolute(options_.place, error).parent_path();
    file = std::filesystem::proximate(it->second.file, place, error).generic_string();
    return {};
  }

  // ---- End-effectors ----

  void add_end_effectors() {
    Node list = sequence_node();
    std::vector<std::string> names;
    const auto add = [&](const std::string& name, const Mark& mark, int group, const Posed& X_GE) {
      Node node = mapping_node(mark);
      names.push_back(name_for(name, mark, "end-effector"));
      put(node, "name", text_node(names.back(), mark));
      put(node, "link", text_node(body_names_[group], mark));
      if (!is_identity(X_GE)) put_pose(node, X_GE, mark);
      list.items.push_back(std::move(node));
    };
    const bool chosen = !options_.end_effectors.empty();
    if (chosen) add_chosen(add);
    if (!chosen) add_outermost(add);
    if (list.items.empty()) return;
    put(result_.tree, "end_effectors", std::move(list));
    decide(grouped_.groups[0].mark,
           fmt::format("end-effectors: {}, {}", some_of(names),
                       chosen ? "as selected" : "the outermost frames (others: end_effectors, --end-effector)"),
           "end_effectors");
  }

  template <class Add>
  void add_chosen(const Add& add) {
    std::vector<std::string> known;
    for (const SourceLink& link : model_.links) known.push_back(link.name);
    for (const SourceFrame& frame : model_.frames) known.push_back(frame.name);
    std::set<std::string> chosen_before;
    for (const StatedName& chosen : options_.end_effectors) {
      if (faults_.full()) return;
      if (!chosen_before.insert(chosen.name).second) {
        faults_.add(chosen.mark, fmt::format("end-effector {} is chosen twice", in_quotes(chosen.name)));
        continue;
      }
      const auto named = [&](const auto& one) { return one.name == chosen.name; };
      const auto link = std::find_if(model_.links.begin(), model_.links.end(), named);
      const auto frame = std::find_if(model_.frames.begin(), model_.frames.end(), named);
      if (link == model_.links.end() && frame == model_.frames.end()) {
        faults_.add(chosen.mark, fmt::format("unknown link or frame {} for an end-effector{}", in_quotes(chosen.name),
                                             suggestion(chosen.name, known, "links and frames")));
        continue;
      }
      const bool is_link = link != model_.links.end();
      const auto [group, X_GL] = place_of(is_link ? link->name : frame->link);
      if (group < 0)
        faults_.add(chosen.mark, fmt::format("{} is not part of the robot", in_quotes(chosen.name)));
      else
        add(chosen.name, is_link ? link->mark : frame->mark, group, is_link ? X_GL : X_GL * frame->X_LF);
    }
  }

  // Leaf links and named frames of moving groups; for a robot without joints those of its base.
  template <class Add>
  void add_outermost(const Add& add) {
    const bool rigid = grouped_.groups.size() == 1;
    for (std::size_t g = rigid ? 0 : 1; g < grouped_.groups.size(); ++g) {
      for (const GroupedLink& one : grouped_.groups[g].links) {
        if (one.link == grouped_.world || is_inner(one.link) || is_on_wheel(one.link)) continue;
        add(model_.links[one.link].name, model_.links[one.link].mark, static_cast<int>(g), one.X_GL);
      }
    }
    for (const SourceFrame& frame : model_.frames) {
      const auto [group, X_GL] = place_of(frame.link);
      const bool taken = names_["end-effector"].contains(frame.name);
      if (group > 0 || (rigid && group == 0)) {
        if (!taken) add(frame.name, frame.mark, group, X_GL * frame.X_LF);
      }
    }
  }

  bool is_on_wheel(int link) const {
    return std::any_of(wheels_.begin(), wheels_.end(), [&](const WheelOfJoint& wheel) {
      return std::find(wheel.links.begin(), wheel.links.end(), link) != wheel.links.end();
    });
  }

  // Whether a link is joined to more than one other link of the robot, or is all of it.
  bool is_inner(int link) const {
    int joined = 0;
    for (const int joint : tree_->child_joints[link]) joined += grouped_.group_of[tree_->child[joint]] >= 0 ? 1 : 0;
    const int carrier = tree_->carrier[link];
    if (carrier >= 0) joined += grouped_.group_of[tree_->parent[carrier]] >= 0 ? 1 : 0;
    return joined != 1 || link == grouped_.groups[0].links[0].link;
  }

  std::pair<int, Posed> place_of(const std::string& link) {
    if (places_.empty()) {
      for (std::size_t g = 0; g < grouped_.groups.size(); ++g) {
        for (const GroupedLink& one : grouped_.groups[g].links)
          places_.emplace(model_.links[one.link].name, std::pair{static_cast<int>(g), one.X_GL});
      }
    }
    const auto it = places_.find(link);
    return it == places_.end() ? std::pair{-1, Posed::identity()} : it->second;
  }

  // ---- Comments ----

  // Every decision becomes a comment at its object: a moving joint, or the body that contains a link.
  void write_comments() {
    std::map<std::string, Node*> places;
    if (Node* list = result_.tree.find("end_effectors")) places.emplace("end_effectors", list);
    Node* links = result_.tree.find("links");
    for (std::size_t g = 0; g < grouped_.groups.size(); ++g) {
      Node* body = g == 0 ? result_.tree.find("base") : &links->items[g - 1];
      for (const GroupedLink& one : grouped_.groups[g].links) places.emplace(model_.links[one.link].name, body);
    }
    std::map<std::string, Node*> joints;
    for (std::size_t j = 0; j < model_.joints.size(); ++j) {
      const int group = grouped_.group_of[tree_->child[j]];
      if (group >= 0)
        joints.emplace(model_.joints[j].name, group == 0 ? result_.tree.find("base") : &links->items[group - 1]);
    }
    for (std::size_t g = 1; g < grouped_.groups.size(); ++g)
      joints[model_.joints[grouped_.groups[g].joint].name] = links->items[g - 1].find("joint");
    for (const ImportDecision& decision : result_.decisions) {
      // Texts about joints begin with "joint", because a link may have the name of a joint.
      const bool of_joint = decision.text.starts_with("joint ");
      Node* place = nullptr;
      for (auto* table : {of_joint ? &joints : &places, of_joint ? &places : &joints}) {
        const auto it = table->find(decision.about);
        if (!place && it != table->end()) place = it->second;
      }
      const std::string file =
          decision.mark.source ? std::filesystem::path(*decision.mark.source).filename().string() : "";
      const std::string where = file.empty()             ? ""
                                : decision.mark.line > 0 ? fmt::format(" ({}:{})", file, decision.mark.line)
                                                         : " (" + file + ")";
      std::string& comment = place ? place->comment : result_.comment;
      comment += (comment.empty() ? "" : "\n") + printable_line(decision.text + where);
    }
  }

  const SourceModel& model_;
  const ImportOptions& options_;
  FaultList& faults_;
  ImportedRobot result_;
  const LinkTree* tree_ = nullptr;
  GroupedLinks grouped_;
  std::vector<WheelOfJoint> wheels_;
  std::string base_name_;
  std::vector<std::string> body_names_;                 // per group
  std::map<std::string, std::set<std::string>> names_;  // in use, by kind
  std::map<std::string, FoundMesh> found_;
  std::map<std::string, std::pair<int, Posed>> places_;  // of links, computed on demand
};

}  // namespace

std::optional<ImportedRobot> assemble_robot(const SourceModel& model, const ImportOptions& options, FaultList& faults) {
  return RobotAssembly(model, options, faults).assemble();
}

}  // namespace grapnel
