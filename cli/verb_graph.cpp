// arbiter graph: a model as a picture, still or of the running system.
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/graph_live.hpp"
#include "cli/graph_picture.hpp"
#include "cli/live.hpp"
#include "cli/model_files.hpp"
#include "cli/numbers.hpp"
#include "cli/output_file.hpp"
#include "cli/port_name.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

int draw_still(const GraphOptions& options) {
  Picture picture(options);
  if (!picture.load(rules::read_texts(options.files))) return 1;
  picture.write(nullptr);
  return picture.is_good() ? 0 : 1;
}

int graph(const GraphOptions& options) {
  if (options.follow && options.output.empty()) {
    throw CLI::RequiredError("--output, the file that --follow writes again at each change,");
  }
  if (options.follow) {
    require_named_file(options.output,
                       "--follow writes a file again at each change; give it a name, such as "
                       "now.svg");
    return draw_and_follow(options);
  }
  if (options.live) return draw_live(options);
  if (options.files.models.empty()) throw CLI::RequiredError("MODEL, or --live,");
  return draw_still(options);
}

}  // namespace

void add_graph(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<GraphOptions>();
  CLI::App* verb = app.add_subcommand("graph", "Draw a model, or what it is doing now");
  add_model_options(*verb, options->files)
      .required(false)
      ->description(
          "Files of behaviours and rules; -: standard input; with --live you may leave them out: "
          "the model in force is drawn");
  verb->add_option("--view", options->view,
                   "behaviours: in meta-behaviours, with inhibitions; connections: components, "
                   "ports, rules; both; auto: behaviours if there are any")
      ->check(one_of({"auto", "behaviours", "connections", "both"}))
      ->type_name("WHICH");
  verb->add_option(
          "--port", options->ports,
          "Only what decides at this input port, or at those that match this pattern, such "
          "as '/Arm/*'; repeatable")
      ->type_name("PATTERN")
      ->allow_extra_args(false)
      ->check(name_of_port(true));
  verb->add_option("--format", options->format,
                   std::string(kGraphFormats) +
                       "; without it by the ending of the file, svg where it has none")
      ->type_name("FORMAT");
  verb->add_option("--dpi", options->dpi,
                   "Dots per inch of a png or jpg, from 20 to 1200; without it 96")
      ->type_name("N");
  verb->add_option("-o,--output", options->output, kOutputHelp)->type_name("FILE");
  add_effort_option(*verb, options->effort);
  auto* live =
      verb->add_flag("--live", options->live, "Colour it by who is active and who wins now");
  auto* follow = verb->add_flag("--follow", options->follow,
                                "Like --live, and write the picture again at each change");
  verb->add_option("--hosts", options->hosts,
                   "Application whose modules have <node>s: draw connections in boxes of hosts; "
                   "with --live the links say where things are")
      ->type_name("FILE")
      ->transform(dash_for_input())
      ->excludes(live)
      ->excludes(follow);
  add_instance_option(*verb, options->instance);
  verb->footer(
      "What is drawn:\n" + drawing::legend_in_words() +
      "A model of many connections is drawn port by port, each with its own sources beside it.\n\n"
      "Pictures are made by Graphviz (apt install graphviz); --format dot does without it.\n"
      "Rules that contradict each other are drawn all the same.\n\n"
      "Examples:\n"
      "  arbiter graph search_and_track.xml -o behaviours.svg\n"
      "  arbiter graph search_and_track.xml --view connections --application application.xml \\\n"
      "      -o ports.png --dpi 200\n"
      "  arbiter graph search_and_track.xml --port /Gaze/pos:i -o gaze.svg\n"
      "  arbiter graph humanoid.xml --port '/Arm/*' -o arms.svg\n"
      "  arbiter graph search_and_track.xml --hosts two_hosts.xml -o hosts.svg\n"
      "  arbiter graph --follow -o now.svg\n\n"
      "Exit codes: 0 drawn; 1 an error in the model, a port that it lacks or that is on no host,\n"
      "no daemon, no Graphviz, or a model that is not the one in force; 2 wrong use, or a file "
      "that\n"
      "cannot be opened or written");
  verb->callback([options, &exit_code] { exit_code = graph(*options); });
}

}  // namespace arbiter::cli
