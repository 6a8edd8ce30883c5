#include "cli/changes.hpp"

#include <iostream>

#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "wire/call.hpp"
#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

void write_in_force(const wire::ChangeReport& report) {
  std::cout << "model " << report.generation.value_or(0) << " is in force\n";
  if (const auto& past = report.back_to) {
    std::cout << "  it is model " << past->generation << " again: " << past->name;
    for (const auto& file : past->files) std::cout << ' ' << file;
    std::cout << " (" << past->how << ")\n";
  }
  if (report.changes) std::cout << "  " << report.changes->summary << '\n';
}

}  // namespace

wire::ChangeReport ask_for_change(const std::string& verb, const std::string& instance,
                                  wire::Message question, bool json) {
  question.flags |= wire::kWantsReport;
  wire::Call daemon(caller(verb, instance));
  const std::string text = wire::change_report_text(daemon.ask(question));
  wire::ChangeReport report = wire::read_change_report(text);
  if (json) {
    std::cout << wire::write_document(wire::parse_document(text));
    return report;
  }
  std::cerr << report.text;
  if (report.has_errors) {
    std::cerr << "arbiter: refused; nothing has changed\n";
  } else if (!report.ok) {
    std::cerr << "arbiter: " << report.why.value_or("refused") << '\n';
  }
  return report;
}

int write_result(const wire::ChangeReport& report, bool json) {
  if (report.ok && !json) write_in_force(report);
  return report.ok ? 0 : 1;
}

}  // namespace arbiter::cli
