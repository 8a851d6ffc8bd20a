// grapnel import: converts a model in URDF or MJCF to a robot file.
#include <fmt/format.h>

#include "commands.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/text/error_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"
#include "output_folder.hpp"
#include "terminal.hpp"

namespace grapnel::app {
namespace {

namespace fs = std::filesystem;

// The arguments as the mapping that scenarios have at `import`, so that both have the same meaning.
class SettingsOfArguments {
 public:
  explicit SettingsOfArguments(FaultList& faults) : faults_(faults) {}

  Node settings(const ImportCommandOptions& options) {
    Node tree = mapping_node(mark_of("grapnel import"));
    const auto put_text = [&](const char* key, const char* option, const std::string& text) {
      if (!text.empty()) put(tree, key, quoted(text, fmt::format("{} {}", option, text)));
    };
    put_text("base", "--base", options.base);
    put_text("bus", "--bus", options.bus);
    put_text("prefix", "--prefix", options.prefix);
    if (!options.mount.empty()) {
      if (auto mount = parse_value(options.mount, mark_of("--mount " + options.mount), faults_))
        put(tree, "mount", std::move(*mount));
    }
    put_pairs(tree, "lock", "--lock", "JOINT=VALUE", options.locked, true);
    put_pairs(tree, "packages", "--package", "NAME=FOLDER", options.packages, false);
    put_names(tree, "wheels", "--wheel", options.wheels);
    put_names(tree, "end_effectors", "--end-effector", options.end_effectors);
    if (options.repair_inertia) put(tree, "repair_inertia", plain("true", "--repair-inertia"));
    return tree;
  }

 private:
  static Mark mark_of(const std::string& argument) { return {std::make_shared<const std::string>(argument), 0, 0}; }
  static Node plain(const std::string& text, const std::string& argument) {
    Node node;
    node.kind = Node::Kind::scalar;
    node.text = text;
    node.mark = mark_of(argument);
    return node;
  }
  static Node quoted(const std::string& text, const std::string& argument) {
    Node node = plain(text, argument);
    node.plain = false;
    return node;
  }

  static void put_names(Node& tree, const char* key, const std::string& option, const std::vector<std::string>& names) {
    if (names.empty()) return;
    Node list = sequence_node(mark_of(option));
    for (const std::string& name : names) list.items.push_back(quoted(name, option + " " + name));
    put(tree, key, std::move(list));
  }

  void put_pairs(Node& tree, const char* key, const char* option, const char* form,
                 const std::vector<std::string>& pairs, bool are_numbers) {
    if (pairs.empty()) return;
    Node mapping = mapping_node(mark_of(option));
    for (const std::string& pair : pairs) {
      const std::string argument = fmt::format("{} {}", option, pair);
      const std::size_t equals = are_numbers ? pair.rfind('=') : pair.find('=');
      if (equals == std::string::npos || equals == 0) {
        faults_.add(mark_of(argument), fmt::format("must be {}", form));
        continue;
      }
      const std::string name = pair.substr(0, equals), value = pair.substr(equals + 1);
      if (mapping.find(name)) {
        faults_.add(mark_of(argument), fmt::format("{} is given twice", in_quotes(name)));
        continue;
      }
      std::optional<Node> node = are_numbers ? parse_value(value, mark_of(argument), faults_) : quoted(value, argument);
      if (node) mapping.entries.push_back({name, mark_of(argument), std::move(*node)});
    }
    put(tree, key, std::move(mapping));
  }

  FaultList& faults_;
};

void say(const std::vector<ImportDecision>& decisions) {
  for (const ImportDecision& one : decisions) {
    const std::string file = one.mark.source ? *one.mark.source : std::string();
    to_stdout("{}\n", printable_line(one.mark.line > 0
                                         ? fmt::format("{}:{}:{}: {}", file, one.mark.line, one.mark.column, one.text)
                                         : fmt::format("{}: {}", file, one.text)));
  }
}

}  // namespace

int import_robot_file(const ImportCommandOptions& options) {
  try {
    FaultList faults;
    const Node settings = SettingsOfArguments(faults).settings(options);
    if (!is_model_file(options.model.string()))
      faults.add({std::make_shared<const std::string>(options.model.string()), 0, 0},
                 "a model to be imported ends in .urdf or .xml");
    std::error_code error;
    // Paths of meshes are relative to this folder.
    const fs::path folder = options.output.parent_path();
    if (!folder.empty() && !fs::is_directory(folder, error))
      faults.add({std::make_shared<const std::string>(options.output.string()), 0, 0},
                 fmt::format("there is no folder {}", in_quotes(folder.string())));
    faults.throw_if_any();

    ScenarioFiles files;
    const auto imported = import_model(options.model, settings, {}, options.output, files, faults);
    faults.throw_if_any();
    std::vector<Fault> warnings;
    const RobotSetup robot = read_imported(*imported, options.output, files, &warnings);
    if (!may_write({options.output})) return kBadInput;
    say(imported->decisions);
    print_errors(warnings);
    std::string comment = fmt::format("Made by grapnel import from {}. Decisions of the import are in comments.",
                                      printable_line(options.model.filename().string()));
    if (!imported->comment.empty()) comment += "\n" + imported->comment;
    write_file_atomically(options.output, yaml_text(imported->tree, comment));
    to_stdout("{}: {}, {}, {}\n", options.output.string(), fmt::format("{} bodies", robot.bodies.size()),
              counted(robot.end_effectors.size(), "end-effector"), counted(imported->decisions.size(), "decision"));
    return kDone;
  } catch (const InputError& error) {
    print_errors(error.faults());
    return kBadInput;
  } catch (const CannotWrite& error) {
    to_stderr("grapnel: error: {}\n", error_text(error));
    return kSimulationFailed;
  }
}

}  // namespace grapnel::app
