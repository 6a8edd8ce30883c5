#include "drawing/drawing.hpp"

#include "drawing/text.hpp"
#include "drawing/views.hpp"

namespace arbiter::drawing {
namespace {

constexpr const char* kFont = "\"Helvetica,Arial,sans-serif\"";
constexpr std::size_t kMaxTitle = 70;  // characters
// Of more lines, Graphviz would seek the best places for minutes, and nobody could follow them.
constexpr std::size_t kMaxCarefulLines = 400;

std::string font(const std::string& attributes, const std::string& content) {
  return "<FONT " + attributes + ">" + content + "</FONT>";
}

const char* in_words(View view) {
  switch (view) {
    case View::kBehaviours:
      return "behaviours";
    case View::kConnections:
      return "connections";
    default:
      return "behaviours and connections";
  }
}

// Only what there is in the picture.
std::string legend_rows(const DotWriter& out, View view, bool is_live) {
  std::string rows;
  for (const LineKind kind : out.lines()) {
    const Line& line = look_of(kind);
    rows += row(small(line.sample, line.colour) + " " +
                small(html(std::string(line.word) + ": " + line.meaning)));
  }
  for (const Sign& sign : kSigns) {
    if (!out.has_sign(sign.text)) continue;
    rows += row(small(sign.text, sign.colour) + " " + small(html(sign.meaning)));
  }
  for (const Mark& mark : kMarks) {
    if (!is_live) break;
    if (view == View::kBehaviours && mark.kind == MarkKind::kActive) continue;
    rows += R"(<TR><TD ALIGN="LEFT" BGCOLOR=")" + std::string(mark.colour) + "\">" +
            small(html(std::string(mark.sign) + " " + mark.meaning)) + "</TD></TR>";
  }
  return rows;
}

void draw_title(const Page& page, View view, bool is_live, DotWriter& out) {
  std::string rows;
  if (!page.name.empty()) {
    rows = row(font("POINT-SIZE=\"14\"",
                    "<B>" + html(shortened(page.name, kMaxTitle)) + "</B> · " + in_words(view)));
  }
  for (const std::string& detail : page.details) {
    rows += row(font("POINT-SIZE=\"10\"", html(shortened(detail, kMaxTitle))));
  }
  rows += legend_rows(out, view, is_live);
  if (rows.empty()) return;
  out.attribute("labelloc", "t");
  out.attribute("labeljust", "l");
  out.attribute("label", R"(<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="1" CELLPADDING="0">)" +
                             rows + "</TABLE>>");
}

}  // namespace

View natural_view(const rules::LoadedModel& model) {
  return model.model.behaviours.empty() ? View::kConnections : View::kBehaviours;
}

std::string draw(const rules::LoadedModel& model, View view, const Page& page,
                 const Situation* situation, const Places* places) {
  DotWriter out;
  out.open("digraph arbiter");
  // Behaviours stand in the order of who overrides whom, from above; data flows to the right.
  const bool downwards = view == View::kBehaviours;
  out.statement("graph", {{"rankdir", downwards ? "TB" : "LR"},
                          {"compound", "true"},
                          {"newrank", "true"},  // boxes stand below those who inhibit them
                          {"fontname", kFont},
                          {"fontsize", "12"},
                          {"nodesep", "0.25"},
                          {"ranksep", downwards ? "0.28" : "1.2"},
                          {"dpi", page.dpi == 0 ? "" : std::to_string(page.dpi)},
                          {"tooltip", "\" \""}});
  out.statement("node", {{"fontname", kFont}, {"fontsize", "11"}, {"shape", "plain"}});
  out.statement("edge", {{"fontname", kFont}, {"fontsize", "9"}, {"arrowsize", "0.8"}});
  if (view != View::kConnections) draw_behaviours(model, situation, out);
  if (view != View::kBehaviours) draw_connections(model, situation, places, out);
  if (out.line_count() > kMaxCarefulLines) {
    for (const char* effort : {"mclimit", "nslimit", "nslimit1"}) out.attribute(effort, "0.1");
    out.attribute("splines", "line");
  }
  draw_title(page, view, situation != nullptr, out);
  out.close();
  return out.take();
}

std::string legend_in_words() {
  std::string text;
  const auto add = [&](const std::string& sample, const std::string& meaning) {
    text += "  " + sample + "  " + meaning + "\n";
  };
  for (const Line& line : kLines) add(line.sample, std::string(line.word) + ": " + line.meaning);
  for (const Sign& sign : kSigns) add(sign.text, sign.meaning);
  for (const Mark& mark : kMarks) {
    add(mark.sign, "with --live, " + std::string(mark.word) + ": " + mark.meaning);
  }
  return text;
}

}  // namespace arbiter::drawing
