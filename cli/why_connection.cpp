// What `arbiter why` says about one connection, or one source that is only sensed.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>

#include "cli/why_answer.hpp"
#include "cli/why_report.hpp"

namespace arbiter::cli {
namespace {

using rules::ConnectionExplanation;

// Per connection, if there are many of them.
constexpr std::size_t kMaxCauses = 3;

}  // namespace

std::string WhyAnswer::state_text(const std::string& source) const {
  std::string text = activity_text(look_.sources, source);
  const std::string component = obstacles_.component_of(source);
  if (component.empty()) return text;
  text += "; component " + component + " has it open";
  if (look_.sources.is_active(source)) return text;
  const bool has_arrived = look_.sources.state(source).word != shm::kNeverActive;
  return text + ", and has sent nothing " + (has_arrived ? "since" : "yet");
}

void WhyAnswer::write_connection(const ConnectionExplanation& connection) const {
  out_ << '\n' << connection.source;
  if (!look_.is_arbitrated) {
    out_ << " is delivered\n  it is " << state_text(connection.source) << '\n';
  } else if (connection.wins) {
    const bool can = obstacles_.why_it_cannot_deliver(connection.source).empty();
    out_ << (can ? " wins\n  " : " is selected, but cannot deliver\n  ")
         << state_text(connection.source) << '\n';
    write_selected(connection);
  } else {
    write_kept_out(connection);
  }
  write_obstacles(out_, obstacles_.of_connection(connection.source));
  if (!options_.source.empty()) write_reasons(connection);
}

void WhyAnswer::write_selected(const ConnectionExplanation& connection) const {
  std::size_t told = 0;
  for (const auto& part : connection.parts) {
    if (!part.causes.empty()) continue;
    if (told++ == kMaxCauses && is_large()) {
      out_ << "  and by other behaviours\n";
      return;
    }
    out_ << "  selected by "
         << (part.behaviour ? describe(*part.behaviour) : std::string("its rule"));
    out_ << place_text(part.where) << '\n';
  }
}

void WhyAnswer::write_kept_out(const ConnectionExplanation& connection) const {
  out_ << " is kept out\n";
  if (connection.has_rule && !connection.is_active) {
    out_ << "  " << state_text(connection.source) << '\n';
  }
  if (!is_short(connection)) {
    write_causes(out_, connection, look_.sources, is_large() ? kMaxCauses : SIZE_MAX);
    if (!connection.has_rule) out_ << "  " << state_text(connection.source) << '\n';
    return;
  }
  const auto has_cause = [](const auto& part) { return !part.causes.empty(); };
  if (connection.earlier ||
      std::all_of(connection.parts.begin(), connection.parts.end(), has_cause)) {
    out_ << "  and by the rules: arbiter why " << port_.name() << ' ' << connection.source << '\n';
  }
}

// If you asked about one connection only: what is wrong with the sources that keep it out.
void WhyAnswer::write_reasons(const ConnectionExplanation& connection) const {
  if (connection.wins) return;
  for (const auto& source : sources_that_matter(connection)) {
    write_obstacles(out_, obstacles_.of_source(source), source);
  }
}

void WhyAnswer::write_sensed(const std::string& source) const {
  out_ << '\n'
       << source << " is sensed: the rules read it, but it has no connection here\n  "
       << state_text(source) << '\n';
  write_obstacles(out_, obstacles_.of_source(source));
}

}  // namespace arbiter::cli
