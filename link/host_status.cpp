#include "link/host_status.hpp"

namespace arbiter::link {

wire::HostStatus status_of(const HostCard& card) {
  wire::HostStatus status;
  status.host = card.host;
  status.incarnation = hexadecimal(card.incarnation);
  status.instance = card.instance;
  status.version = card.version;
  status.has_daemon = card.has_daemon;
  if (card.generation != 0) {
    wire::HostModel& model = status.model.emplace();
    model.generation = card.generation;
    model.name = card.model;
    if (card.digest != 0) model.digest = hexadecimal(card.digest);
  }
  status.imports = card.imports;
  status.input_count = card.input_count;
  status.output_count = card.output_count;
  status.inputs = card.inputs;
  status.outputs = card.outputs;
  return status;
}

wire::HostDisagreement status_of(const Disagreement& disagreement) {
  wire::HostDisagreement status;
  static_assert(static_cast<int>(DisagreementKind::kModel) ==
                static_cast<int>(wire::DisagreementKind::kModel));
  status.kind = static_cast<wire::DisagreementKind>(disagreement.kind);
  if (!disagreement.name.empty()) status.name = disagreement.name;
  status.hosts = disagreement.hosts;
  status.is_error = disagreement.is_error();
  status.text = disagreement.text();
  return status;
}

wire::HostOutcome outcome_of(OpenQuestions::Outcome outcome) {
  switch (outcome) {
    case OpenQuestions::Outcome::kAnswered:
      return wire::HostOutcome::kAnswered;
    case OpenQuestions::Outcome::kRefused:
      return wire::HostOutcome::kRefused;
    default:
      return wire::HostOutcome::kSilent;
  }
}

}  // namespace arbiter::link
