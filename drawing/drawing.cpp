#include "drawing/drawing.hpp"

#include "drawing/views.hpp"

namespace arbiter::drawing {
namespace {

constexpr const char* kFont = "\"Helvetica,Arial,sans-serif\"";

void draw_legend(DotWriter& out) {
  const auto row = [](const char* fill, const char* text) {
    return std::string(R"(<TR><TD ALIGN="LEFT" BGCOLOR=")") + fill + "\">" + text + "</TD></TR>";
  };
  out.statement("legend", {{"shape", "plain"},
                           {"tooltip", "\"legend\""},
                           {"label", R"(<<TABLE BORDER="0" CELLBORDER="1" CELLSPACING="0">)" +
                                         row(colour::kPaleWins, "▶ wins, runs") +
                                         row(colour::kPaleOverridden, "✕ active, and overridden") +
                                         row(colour::kPaleActive, "● active") +
                                         row(colour::kPaper, "○ inactive") + "</TABLE>>"}});
}

}  // namespace

View natural_view(const rules::LoadedModel& model) {
  return model.model.behaviours.empty() ? View::kConnections : View::kBehaviours;
}

std::string draw(const rules::LoadedModel& model, View view, const Situation* situation) {
  DotWriter out;
  out.open("digraph arbiter");
  // Behaviours stand in the order of who overrides whom, from above; data flows to the right.
  const bool downwards = view == View::kBehaviours;
  // Many connections need room to be told apart.
  const bool is_large = model.rules.sources.size() > 25;
  out.statement("graph", {{"rankdir", downwards ? "TB" : "LR"},
                          {"compound", "true"},
                          {"fontname", kFont},
                          {"fontsize", "12"},
                          {"nodesep", "0.25"},
                          {"ranksep", downwards  ? "0.45"
                                      : is_large ? "3"
                                                 : "1.2"},
                          {"tooltip", "\" \""}});
  out.statement("node", {{"fontname", kFont}, {"fontsize", "11"}, {"shape", "plain"}});
  out.statement("edge", {{"fontname", kFont}, {"fontsize", "9"}, {"arrowsize", "0.8"}});
  if (view != View::kConnections) draw_behaviours(model, situation, out);
  if (view != View::kBehaviours) draw_connections(model, situation, out);
  if (situation != nullptr) draw_legend(out);
  out.close();
  return out.take();
}

}  // namespace arbiter::drawing
