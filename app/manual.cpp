#include "manual.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace grapnel::app {
namespace {

// What bash completes after a word of the command line.
enum class Completion { files, yaml_files, folders, choices, nothing };

struct Argument {
  std::vector<std::string> names;  // "-o", "--output"; for a positional argument: "scenario"
  std::string value;               // type of the value: "TEXT", "INT"; empty: takes no value
  std::vector<std::string> choices;
  std::string description;
  bool positional = false, required = false, many = false;

  Completion completion() const {
    const auto mentions = [&](std::string_view word) { return description.find(word) != std::string::npos; };
    if (!choices.empty()) return Completion::choices;
    if (value != "TEXT") return Completion::nothing;
    if (mentions("(YAML)")) return Completion::yaml_files;
    if (description.starts_with("File")) return Completion::files;
    if (mentions("Folder") || mentions("folder")) return Completion::folders;
    return positional || mentions("page") ? Completion::files : Completion::nothing;
  }
};

struct Command {
  std::string name, description;
  std::vector<std::string> aliases;
  std::vector<Argument> arguments;
};

// The choices of an option: CLI11 stores them only in the name of its type, "TEXT:{x,y,z}".
std::vector<std::string> choices_of(const std::string& type) {
  const std::size_t open = type.find('{'), close = type.rfind('}');
  std::vector<std::string> choices;
  if (open == std::string::npos || close == std::string::npos) return choices;
  for (std::size_t begin = open + 1; begin <= close;) {
    const std::size_t end = std::min(type.find(',', begin), close);
    choices.push_back(type.substr(begin, end - begin));
    begin = end + 1;
  }
  return choices;
}

Argument argument_of(const CLI::Option& option) {
  Argument a;
  a.description = option.get_description();
  a.required = option.get_required();
  a.many = option.get_items_expected_max() > 1;
  a.positional = option.nonpositional() ? false : option.get_positional();
  const std::string type = option.get_type_name();
  a.choices = choices_of(type);
  if (option.get_items_expected_max() > 0) a.value = type.substr(0, type.find(':'));
  if (a.positional) {
    a.names = {option.get_name(true, false)};
    return a;
  }
  for (const std::string& name : option.get_snames()) a.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) a.names.push_back("--" + name);
  return a;
}

// Options of the command itself and of its groups, which CLI11 stores as subcommands without a name.
void add_arguments(const CLI::App& app, std::vector<Argument>& arguments) {
  for (const CLI::Option* option : app.get_options()) arguments.push_back(argument_of(*option));
  for (const CLI::App* group : app.get_subcommands(nullptr)) {
    if (group->get_name().empty()) add_arguments(*group, arguments);
  }
}

Command command_of(const CLI::App& app) {
  Command command{app.get_name(), app.get_description(), app.get_aliases(), {}};
  add_arguments(app, command.arguments);
  return command;
}

std::vector<Command> commands_of(const CLI::App& app) {
  std::vector<Command> commands;
  for (const CLI::App* one : app.get_subcommands(nullptr)) {
    if (!one->get_name().empty()) commands.push_back(command_of(*one));
  }
  return commands;
}

// "grapnel run [OPTIONS] scenario"; `markup` surrounds the names of arguments.
std::string synopsis(const std::string& program, const Command& command, std::string_view before,
                     std::string_view after) {
  std::string text = fmt::format("{} {} [OPTIONS]", program, command.name);
  for (const Argument& a : command.arguments) {
    if (!a.positional) continue;
    const std::string name = fmt::format("{}{}{}{}", before, a.names.front(), after, a.many ? "..." : "");
    text += a.required ? " " + name : " [" + name + "]";
  }
  return text;
}

// Escapes text for roff: hyphens become minus signs, which can be searched and copied, and no line begins with a
// request.
std::string roff(std::string_view text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
    line_begins = c == '\n';
  }
  return out;
}

std::string roff_arguments(const std::vector<Argument>& arguments) {
  std::string text;
  for (const Argument& a : arguments) {
    std::vector<std::string> names;
    for (const std::string& name : a.names)
      names.push_back(a.positional ? "\\fI" + roff(name) + "\\fR" : "\\fB" + roff(name) + "\\fR");
    text += fmt::format(".TP\n{}", fmt::join(names, ", "));
    if (!a.positional && !a.value.empty()) text += fmt::format(" \\fI{}\\fR", roff(a.value));
    text += fmt::format("\n{}", roff(a.description));
    if (!a.choices.empty()) text += roff(fmt::format("; one of {}", fmt::join(a.choices, ", ")));
    text += ".\n";
  }
  return text;
}

constexpr std::string_view kFiles = R"(.SH FILES
.TP
\fI/usr/share/grapnel/scenarios\fR, \fIrobots\fR, \fIstudies\fR
What can be run as it is, and copied to begin with. With another prefix than /usr they are in \fIshare/grapnel\fR below that.
.TP
\fI/usr/share/grapnel/schemas\fR
JSON Schemas of all files that are read, for editors: a first line
\fB# yaml\-language\-server: $schema=PATH\fR makes one check and complete a file.
.TP
\fI/usr/share/grapnel/docs\fR
The documentation, in Markdown.
.SH ENVIRONMENT
.TP
\fBGRAPNEL_LANES\fR
Instruction set of the lanes in which campaigns, impacts and plans are computed: \fBavx512\fR, \fBavx2\fR, \fBsse2\fR,
\fBone_lane\fR or \fBoff\fR (none). Default: the widest that the processor has.
)";

// Escapes characters that have a meaning in Markdown.
std::string markdown(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (std::string_view("|*_<>[]`\\").find(c) != std::string_view::npos) out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

std::string_view exit_codes() {
  return "Exit codes: 0 done; 1 the simulation or its conservation checks failed, a log disagrees, or a result could\n"
         "not be written (the results computed so far are kept); 2 bad input; 3 some points of a study or cases of a\n"
         "campaign failed; 130 stopped by Ctrl-C (completed results are kept).";
}

std::string manual_page(const CLI::App& app) {
  const std::string program = app.get_name();
  const std::vector<Command> commands = commands_of(app);
  const std::string description = app.get_description();  // "Grapnel: simulates ..."
  const std::size_t colon = description.find(": ");
  std::string text = ".\\\" Made by `grapnel manual` from the program's arguments.\n";
  text += fmt::format(".TH GRAPNEL 1 \"\" \"grapnel {}\" \"User Commands\"\n", GRAPNEL_VERSION);
  text += fmt::format(".SH NAME\n{} \\- {}\n.SH SYNOPSIS\n", roff(program),
                      roff(colon == std::string::npos ? description : description.substr(colon + 2)));
  for (const Command& command : commands) {
    text += fmt::format(".B {}\n.br\n", roff(synopsis(program, command, "", "")));
  }
  text += ".SH DESCRIPTION\n" + roff(description) +
          ".\nGrapnel simulates the approach, the impact and the motion afterwards. It checks momentum, energy and "
          "loop closure "
          "in each result.\n"
          "All errors of an input file are reported together on stderr, as\n.IR file:line:column :\n.BR error: \" "
          "...\"\n.SH COMMANDS\n";
  for (const Command& command : commands) {
    text += fmt::format(".SS {} {}\n{}.\n", roff(program), roff(command.name), roff(command.description));
    if (!command.aliases.empty())
      text += fmt::format("Also called {}.\n", roff(fmt::format("{}", fmt::join(command.aliases, ", "))));
    text += roff_arguments(command.arguments);
  }
  text += ".SH OPTIONS\n" + roff_arguments(command_of(app).arguments);
  text += ".SH \"EXIT STATUS\"\n" + roff(exit_codes()) + "\n";
  text += kFiles;
  text += ".SH \"SEE ALSO\"\n.BR gnuplot (1),\nused by\n.B grapnel figure\n";
  return text;
}

std::string manual_markdown(const CLI::App& app) {
  const std::string program = app.get_name();
  std::string text =
      fmt::format("# Commands\n\nEvery command of the program with its options, as in `{} --help` and `man {}`.\n",
                  program, program);
  for (const Command& command : commands_of(app)) {
    text += fmt::format("\n## {} {}\n\n{}.\n\n```text\n{}\n```\n\n| Argument | Meaning |\n|---|---|\n", program,
                        command.name, markdown(command.description), synopsis(program, command, "", ""));
    for (const Argument& a : command.arguments) {
      std::string choices = a.choices.empty() ? "" : fmt::format("; one of `{}`", fmt::join(a.choices, "`, `"));
      text +=
          fmt::format("| `{}`{} | {}{} |\n", fmt::join(a.names, "`, `"),
                      a.positional || a.value.empty() ? "" : " `" + a.value + "`", markdown(a.description), choices);
    }
  }
  return text + fmt::format("\n## Exit codes\n\n{}\n", exit_codes());
}

std::string bash_completion(const CLI::App& app) {
  const std::string program = app.get_name();
  const std::vector<Command> commands = commands_of(app);
  const auto words_of = [&](Completion kind, const std::vector<std::string>& choices) {
    switch (kind) {
      case Completion::files:
        return "_" + program + "_files";
      case Completion::yaml_files:
        return "_" + program + "_yaml";
      case Completion::folders:
        return "_" + program + "_folders";
      case Completion::choices:
        return fmt::format("_{}_words '{}'", program, fmt::join(choices, " "));
      case Completion::nothing:
        break;
    }
    return std::string(":");
  };
  std::string options, values, positionals;
  std::vector<std::string> names;
  for (const Command& command : commands) {
    std::vector<std::string> called{command.name};
    called.insert(called.end(), command.aliases.begin(), command.aliases.end());
    names.insert(names.end(), command.name);
    std::vector<std::string> offered;
    std::string positional;
    for (const Argument& a : command.arguments) {
      if (a.positional) {
        if (positional.empty()) positional = words_of(a.completion(), a.choices);
        continue;
      }
      offered.insert(offered.end(), a.names.begin(), a.names.end());
      if (a.value.empty()) continue;
      std::vector<std::string> cases;
      for (const std::string& one : called) {
        for (const std::string& name : a.names) cases.push_back(fmt::format("'{} {}'", one, name));
      }
      values += fmt::format("    {}) {} ;;\n", fmt::join(cases, " | "), words_of(a.completion(), a.choices));
    }
    options += fmt::format("    {}) _{}_words '{}' ;;\n", fmt::join(called, " | "), program, fmt::join(offered, " "));
    if (!positional.empty()) positionals += fmt::format("    {}) {} ;;\n", fmt::join(called, " | "), positional);
  }
  std::vector<std::string> of_program;
  for (const Argument& a : command_of(app).arguments)
    of_program.insert(of_program.end(), a.names.begin(), a.names.end());

  return fmt::format(
      R"(# Completions of {0} for bash, made by `{0} completion bash`; zsh reads them after `autoload bashcompinit && bashcompinit`.

_{0}_words() {{ mapfile -t COMPREPLY < <(compgen -W "$1" -- "$word"); }}
_{0}_files() {{ mapfile -t COMPREPLY < <(compgen -f -- "$word"); }}
_{0}_folders() {{ mapfile -t COMPREPLY < <(compgen -d -- "$word"); }}
_{0}_yaml() {{ mapfile -t COMPREPLY < <(compgen -d -- "$word"; compgen -f -X '!*.yaml' -- "$word"); }}

_{0}() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} command='' i
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; ++i)); do
    if [[ ${{COMP_WORDS[i]}} != -* ]]; then
      command=${{COMP_WORDS[i]}}
      break
    fi
  done
  if [[ -z $command ]]; then
    if [[ $word == -* ]]; then _{0}_words '{1}'; else _{0}_words '{2}'; fi
  else
    case "$command $previous" in
{3}    *)
      if [[ $word == -* ]]; then
        case $command in
{4}        esac
      else
        case $command in
{5}        esac
      fi ;;
    esac
  fi
}}
complete -o filenames -F _{0} {0}
)",
      program, fmt::join(of_program, " "), fmt::join(names, " "), values, options, positionals);
}

}  // namespace grapnel::app
