#include "cli/changes.hpp"

#include <cstdint>
#include <functional>
#include <iostream>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"
#include "watch/model_in_force.hpp"
#include "wire/call.hpp"
#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

// Of a dry run: whether that is what would come into force, and not only be read again.
bool would_replace(const wire::ChangeReport& report, const wire::ModelComparison& model) {
  return model.in_force || report.back_to.has_value();
}

void write_past(const std::string& what, const wire::PastModelStatus& past) {
  std::cout << what << past.name;
  for (const auto& file : past.files) std::cout << ' ' << file;
  std::cout << " (" << past.how << ")\n";
}

void write_in_force(const wire::ChangeReport& report) {
  const std::uint64_t generation = report.generation.value_or(0);
  std::cout << (generation == 0 ? "no model" : "model " + std::to_string(generation))
            << " is in force" << (report.already.value_or(false) ? " already" : "") << '\n';
  if (const auto& past = report.back_to) {
    write_past("  it is model " + std::to_string(past->generation) + " again: ", *past);
  }
  if (report.changes) std::cout << "  " << report.changes->summary << '\n';
  if (report.policy && report.policy->differs) {
    std::cout << "the policy " << report.policy->file << " is in force, "
              << rules::counted(report.policy->rules, "rule") << '\n';
  }
}

using IsWrong = std::function<bool(const wire::InputStatus&)>;

// Those of the input ports that somebody has open. Nothing where that cannot be seen: who may
// change the model need not be allowed to observe.
std::optional<std::vector<std::string>> open_ports(const std::string& verb,
                                                   const std::string& instance,
                                                   const IsWrong& is_wrong) {
  std::vector<std::string> names;
  try {
    for (const wire::InputStatus& port : fetch_status(verb, instance).inputs) {
      if (port.open && is_wrong(port)) names.push_back(port.name);
    }
  } catch (const wire::CallError&) {
    return {};
  }
  return names;
}

void write_open(const std::string& what, const std::optional<std::vector<std::string>>& names) {
  if (!names || names->empty()) return;
  std::cout << "  " << what << ": " << rules::enumerate(*names) << '\n';
}

// That the model in force does not mention, or in a dry run will not.
std::optional<std::vector<std::string>> unmentioned(const std::string& verb,
                                                    const std::string& instance,
                                                    const wire::ChangeReport& report,
                                                    bool is_dry_run) {
  if (!report.ok) return {};
  if (!is_dry_run) {
    if (report.generation.value_or(0) == 0) return std::vector<std::string>();
    return open_ports(verb, instance,
                      [](const wire::InputStatus& port) { return !port.mentioned; });
  }
  std::set<std::string> dropped;
  for (const auto& model : report.models.value_or(std::vector<wire::ModelComparison>())) {
    if (!would_replace(report, model) || !model.changes || !model.changes->diff) continue;
    for (const wire::PortDifference& each : model.changes->diff->ports) {
      if (!each.after.exists) dropped.insert(each.port);
    }
  }
  if (dropped.empty()) return std::vector<std::string>();
  return open_ports(verb, instance,
                    [&](const wire::InputStatus& port) { return dropped.contains(port.name); });
}

void add_files(const wire::LoadedModelStatus& model, std::set<std::string>& files) {
  files.insert(model.files.begin(), model.files.end());
  if (model.application) files.insert(*model.application);
}

// The files of which the daemon speaks.
std::set<std::string> files_in(const nlohmann::json& report) {
  std::set<std::string> files;
  for (const auto& part : report.value("findings", nlohmann::json::array())) {
    for (const auto& finding : part.value("findings", nlohmann::json::array())) {
      if (finding.contains("file") && finding["file"].is_string()) files.insert(finding["file"]);
    }
  }
  return files;
}

bool begins_a_path(const std::string& text, std::size_t at) {
  return at == 0 || std::string_view(" \n(").find(text[at - 1]) != std::string_view::npos;
}

// "follow.xml:3:5" in a text becomes "d/follow.xml:3:5".
void replace_path(std::string& text, const std::string& path, const std::string& by) {
  const std::string place = path + ':';
  for (std::size_t at = text.find(place); at != std::string::npos; at = text.find(place, at)) {
    if (!begins_a_path(text, at)) {
      at += place.size();
      continue;
    }
    text.replace(at, path.size(), by);
    at += by.size() + 1;
  }
}

// The daemon was given its files in a directory of its own: whoever reads this works in another.
void name_files_from_here(wire::ChangeReport& report, const nlohmann::json& document,
                          const std::string& verb, const std::string& instance) {
  if (report.text.empty() && !report.why) return;
  try {
    const wire::Status status = fetch_status(verb, instance);
    if (status.directory.empty()) return;
    std::set<std::string> files = files_in(document);
    for (const wire::LoadedModelStatus& each : status.models) add_files(each, files);
    for (const std::string& file : files) {
      if (file.starts_with('/')) continue;
      const std::string path = watch::path_from_here(file, status.directory);
      replace_path(report.text, file, path);
      if (report.why) replace_path(*report.why, file, path);
    }
  } catch (const wire::CallError&) {
    // Who may reload need not be allowed to see where the daemon runs.
  }
}

// Of the input ports that a dry run drops from the model in force, those that somebody has open.
void write_dropped(const std::string& verb, const std::string& instance,
                   const wire::ChangeReport& report) {
  for (const auto& model : report.models.value_or(std::vector<wire::ModelComparison>())) {
    if (!would_replace(report, model)) continue;
    write_open("open now, and no longer mentioned by model " +
                   rules::quote(shm::printable(model.name)) + ", so that no sample would arrive",
               unmentioned(verb, instance, report, true));
  }
}

// A daemon that does not know the flag has tried a reload: its report is about something else.
void require_way_back(const wire::Message& question, const wire::Received& answer,
                      const wire::ChangeReport& report) {
  const bool goes_back = (question.flags & wire::kGoesBack) != 0;
  if (!goes_back || !report.ok || report.back_to) return;
  const std::string why = answer.message.kind == wire::MessageKind::kDone
                              ? "the daemon had no descriptor left for its report"
                              : "the daemon is older than this program, and cannot say what a "
                                "rollback would do";
  throw std::runtime_error(why + "; nothing has changed");
}

// What to type in place of the dry run.
std::string command_for(const std::string& verb, const std::string& instance,
                        const wire::ChangeReport& report) {
  std::string command = "arbiter " + verb;
  if (report.back_to) command += ' ' + std::to_string(report.back_to->generation);
  if (!instance.empty()) command += " --instance " + instance;
  return command;
}

// One model of several, in a dry run. A difference begins with a line of its own.
void write_changes(const wire::ModelComparison& model, bool is_alone) {
  const std::string text = model.changes
                               ? model.changes->text
                               : "not compared: the model in force comes from an earlier daemon\n";
  const bool is_one_line = text.find('\n') + 1 == text.size();
  if (!is_alone) {
    std::cout << model.name << (model.in_force ? " (in force):" : ":")
              << (is_one_line ? ' ' : '\n');
  }
  std::cout << text;
}

}  // namespace

wire::ChangeReport ask_for_change(const std::string& verb, const std::string& instance,
                                  wire::Message question, bool json) {
  question.flags |= wire::kWantsReport;
  wire::Call daemon(caller(verb, instance));
  const wire::Received answer = daemon.ask(question);
  const std::string text = wire::change_report_text(answer);
  wire::ChangeReport report = wire::read_change_report(text);
  require_way_back(question, answer, report);
  const bool is_dry_run = (question.flags & wire::kDryRun) != 0;
  nlohmann::json document = wire::parse_document(text);
  if (json) {
    const auto ports = unmentioned(verb, instance, report, is_dry_run);
    document["unmentioned"] = ports ? nlohmann::json(*ports) : nlohmann::json(nullptr);
    std::cout << wire::write_document(document);
    return report;
  }
  name_files_from_here(report, document, verb, instance);
  std::cerr << report.text;
  if (report.has_errors) {
    std::cerr << "arbiter: refused; nothing has changed\n";
  } else if (!report.ok) {
    std::cerr << "arbiter: " << report.why.value_or("refused") << '\n';
  }
  return report;
}

int change_model(const std::string& verb, const std::string& instance,
                 const wire::Message& question, bool json) {
  const auto report = ask_for_change(verb, instance, question, json);
  if (!report.ok) return 1;
  if (!json) {
    write_in_force(report);
    write_open("open, but not mentioned by this model, so that no sample arrives",
               unmentioned(verb, instance, report, false));
  }
  return 0;
}

int preview_change(const std::string& verb, const std::string& instance,
                   const wire::Message& question, bool json) {
  const auto report = ask_for_change(verb, instance, question, json);
  if (json || !report.ok) return report.ok ? 0 : 1;
  if (report.back_to) {
    write_past("back to model " + std::to_string(report.back_to->generation) + ": ",
               *report.back_to);
  }
  const auto models = report.models.value_or(std::vector<wire::ModelComparison>());
  for (const auto& model : models) write_changes(model, models.size() == 1);
  write_dropped(verb, instance, report);
  if (report.policy && report.policy->differs) {
    std::cout << "the policy " << report.policy->file << " differs from the one in force: it has "
              << rules::counted(report.policy->rules, "rule") << '\n';
  }
  std::cout << "this was a dry run: " << command_for(verb, instance, report) << " puts "
            << (report.back_to ? "that model" : "the files") << " in force\n";
  return 0;
}

}  // namespace arbiter::cli
