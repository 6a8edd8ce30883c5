// How explanations are told: in words and as JSON.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "rules/explain/explain.hpp"
#include "shm/activity.hpp"
#include "watch/obstacles.hpp"
#include "watch/sources.hpp"
#include "watch/span.hpp"

namespace arbiter::cli {

using watch::Sources;
using watch::SourceState;
using watch::span_text;

// "active (arrived 40 ms ago, T 500ms)", "inactive (last arrival 3.2 s ago, T 500ms)".
std::string activity_text(const Sources& sources, const std::string& name);
nlohmann::json activity_json(const Sources& sources, const std::string& name);

// " (m.xml:9)"; nothing where that is not known.
std::string place_text(const rules::Location& where);

// In one line, without the name of the connection: "inhibited by …".
std::string cause_text(const rules::Cause& cause, const Sources& sources);
nlohmann::json cause_json(const rules::Cause& cause);
// The same without activities, and without whose it is: "inhibited by behaviour "X" (m.xml:9)".
std::string headline(const rules::Cause& cause);

// The first of what keeps a connection out, in one line; of one that has several behaviours, that
// of the first.
std::string first_cause(const rules::ConnectionExplanation& connection, const Sources& sources);

// All of what keeps it out, without activities; nothing where it wins, or would if it were active.
std::vector<std::string> causes_in_short(const rules::ConnectionExplanation& connection);

// "inhibited by …", "out: …": why one that had won does not any more, though it is active.
std::string loss_text(const rules::ConnectionExplanation& loser, const Sources& sources);

// What of the rules keeps it out, a line each, indented; of each behaviour at most so many lines,
// and one that says how many more there are.
void write_causes(std::ostream& out, const rules::ConnectionExplanation& connection,
                  const Sources& sources, std::size_t max_lines);
nlohmann::json connection_json(const rules::ConnectionExplanation& connection,
                               const Sources& sources);

// "/Face/pos:o arrived", "/Object/pos:o went inactive, 500 ms after its last arrival".
std::string event_text(const std::string& source, const SourceState& state, shm::Nanoseconds now);
// "active", "expired", "deactivated", and when it became so; of a beginning that is not known, when
// it last arrived.
nlohmann::json event_json(const std::string& source, const SourceState& state,
                          shm::Nanoseconds now);

nlohmann::json obstacles_json(const std::vector<watch::Obstacle>& obstacles);
// One line each. `of`: whose they are, if the reader could not tell.
void write_obstacles(std::ostream& out, const std::vector<watch::Obstacle>& obstacles,
                     const std::string& of = {});

// The sources that an explanation of a connection names as its reasons.
std::vector<std::string> sources_that_matter(const rules::ConnectionExplanation& connection);

}  // namespace arbiter::cli
