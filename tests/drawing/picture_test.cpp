// What there is in a picture, of models of five, forty and a hundred behaviours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drawing/drawing.hpp"
#include "drawing/graphviz.hpp"
#include "drawing/look.hpp"
#include "tests/rules/model_text.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::drawing {
namespace {

using rules::Folder;
using testing::HasSubstr;
using testing::Not;

using Pairs = std::set<std::pair<std::string, std::string>>;

struct Drawable {
  rules::LoadedModel loaded;
  Pairs inhibitions;  // by name
};

rules::LoadedModel load_model(const std::string& text) {
  const Folder folder;
  rules::Diagnostics diagnostics;
  auto loaded =
      rules::load_all(rules::read_texts({{folder.write("a.xml", text)}, {}}), diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  return loaded;
}

// So many behaviours in boxes in boxes, each at one of four ports, with inhibitions among siblings,
// which may go in circles.
Drawable make_model(std::size_t behaviours, double density, bool has_circles, unsigned seed) {
  std::mt19937 random(seed);
  const auto chance = [&](double p) { return std::bernoulli_distribution(p)(random); };
  std::vector<std::string> free;
  std::vector<std::vector<std::string>> families;
  std::string text = "<behaviors>";
  for (std::size_t i = 0; i < behaviours; ++i) {
    free.push_back("Behaviour " + std::to_string(i));
  }
  const std::vector<std::string> leaves = free;
  for (int box = 0; free.size() > 10; ++box) {
    std::shuffle(free.begin(), free.end(), random);
    const std::size_t count = 1 + random() % std::min<std::size_t>(8, free.size() / 2);
    families.emplace_back(free.end() - static_cast<std::ptrdiff_t>(count), free.end());
    free.resize(free.size() - count);
    free.push_back("Box " + std::to_string(box));
    text += "<meta_behavior name='" + free.back() + "'>";
    for (const auto& child : families.back()) text += "<behavior>" + child + "</behavior>";
    text += "</meta_behavior>";
  }
  families.push_back(free);
  Pairs inhibitions;
  std::map<std::string, std::string> lists;
  for (const auto& family : families) {
    for (std::size_t i = 0; i < family.size(); ++i) {
      for (std::size_t j = has_circles ? 0 : i + 1; j < family.size(); ++j) {
        if (i == j || !chance(density)) continue;
        inhibitions.emplace(family[i], family[j]);
        lists[family[i]] += "<inhibition>" + family[j] + "</inhibition>";
      }
    }
  }
  for (const std::string& leaf : leaves) {
    text += "<behavior name='" + leaf + "'><config at='/P" + std::to_string(random() % 4) +
            "/in:i'>/" + leaf.substr(10) + "/out:o</config>" + lists[leaf] + "</behavior>";
    lists.erase(leaf);
  }
  for (const auto& [box, list] : lists) {
    text =
        std::regex_replace(text, std::regex("(<meta_behavior name='" + box + "'>)"), "$1" + list);
  }
  return {load_model(text + "</behaviors>"), inhibitions};
}

std::vector<std::string> lines_of(const std::string& dot) {
  std::vector<std::string> lines;
  std::istringstream in(dot);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line.substr(std::min(line.find_first_not_of(' '), line.size())));
  }
  return lines;
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t result = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++result;
  return result;
}

// That somebody can find out from the picture, each once.
Pairs readable_inhibitions(const std::string& dot) {
  static const std::regex kSaid(R"(\\n((?:Behaviour|Box) \d+) inhibits ((?:Behaviour|Box) \d+), )");
  Pairs found;
  for (std::string line : lines_of(dot)) {
    const auto tooltip = line.find("tooltip=\"");
    if (tooltip == std::string::npos) continue;
    line = "\\n" + line.substr(tooltip + 9);
    for (std::sregex_iterator it(line.begin(), line.end(), kSaid), end; it != end; ++it) {
      EXPECT_TRUE(found.emplace((*it)[1], (*it)[2]).second) << (*it)[0] << " is said twice";
    }
  }
  return found;
}

class Pictures : public testing::TestWithParam<unsigned> {};

TEST_P(Pictures, HaveEachBehaviourOnceAndEachInhibition) {
  const unsigned seed = GetParam();
  const std::vector<std::size_t> sizes{5, 12, 40, 100};
  const Drawable model =
      make_model(sizes[seed % 4], seed % 3 == 0 ? 0.9 : 0.3, seed % 5 == 0, seed);
  const std::string dot = draw(model.loaded, View::kBehaviours);
  for (std::size_t b = 0; b < model.loaded.model.behaviours.size(); ++b) {
    const auto& behaviour = model.loaded.model.behaviours[b];
    const std::string id = "b" + std::to_string(b);
    EXPECT_EQ(
        count(dot, behaviour.is_meta ? "subgraph cluster_" + id + " {\n" : " " + id + " [shape"),
        1u)
        << id;
    EXPECT_EQ(count(dot, "<B>" + behaviour.name + "</B>"), 1u) << behaviour.name;
  }
  EXPECT_EQ(readable_inhibitions(dot), model.inhibitions);
}

// What is to be seen is an inhibition and red, what only holds things in their places is not seen.
TEST_P(Pictures, HaveArrowsOfTheRightColour) {
  const unsigned seed = GetParam();
  const Drawable model = make_model(40, 0.3, false, seed);
  int red = 0;
  for (const std::string& line : lines_of(draw(model.loaded, View::kBehaviours))) {
    if (line.find(" -> ") == std::string::npos) continue;
    const bool is_inhibition = line.find(" inhibits ") != std::string::npos;
    const auto has = [&](LineKind kind) {
      return line.find(std::string("color=\"") + look_of(kind).colour) != std::string::npos;
    };
    EXPECT_EQ(is_inhibition, line.find("style=invis") == std::string::npos) << line;
    EXPECT_EQ(is_inhibition, has(LineKind::kInhibits) || has(LineKind::kInhibitsPast)) << line;
    red += has(LineKind::kInhibits) ? 1 : 0;
  }
  EXPECT_EQ(red > 0, !model.inhibitions.empty());
}

INSTANTIATE_TEST_SUITE_P(OfRandomModels, Pictures, testing::Range(1u, 41u));

// dot has been seen to fail on edges between boxes; what it takes of such a picture it draws.
TEST(Picture, OfFortyBehavioursIsOneThatGraphvizDraws) {
  const Drawable model = make_model(40, 0.3, false, 11);
  for (const View view : {View::kBehaviours, View::kConnections, View::kBoth}) {
    const Layout layout = lay_out(draw(model.loaded, view), "svg");
    EXPECT_TRUE(layout.picture.ends_with("</svg>\n"));
    EXPECT_FALSE(layout.is_shrunk);
  }
}

std::string list_of(std::size_t count) {
  std::string text = "<behaviors>";
  for (std::size_t i = 0; i < count; ++i) {
    text += "<behavior name='L" + std::to_string(i) + "'><config at='/p'>/s" + std::to_string(i) +
            "</config>";
    for (std::size_t j = i + 1; j < count; ++j) {
      text += "<inhibition>L" + std::to_string(j) + "</inhibition>";
    }
    text += "</behavior>";
  }
  return text + "</behaviors>";
}

// 780 inhibitions.
TEST(Picture, OfAListOfFortyHasAnArrowFromEachToTheNext) {
  const std::string dot = draw(load_model(list_of(40)), View::kBehaviours);
  EXPECT_EQ(count(dot, " inhibits L1,"), 1u);
  int arrows = 0;
  for (const std::string& line : lines_of(dot)) {
    if (line.find(" -> ") != std::string::npos && line.find(" inhibits ") != std::string::npos) {
      ++arrows;
    }
  }
  EXPECT_EQ(arrows, 39);
  EXPECT_EQ(count(dot, kAllAfter), 38u + 1);  // and in the legend
}

// Sixty behaviours of which each inhibits every second other one took dot more than a minute.
TEST(Picture, OfATangleIsLaidOutWithLessCare) {
  const auto tangle = [](std::size_t count) {
    std::string text = "<behaviors>";
    for (std::size_t i = 0; i < count; ++i) {
      text += "<behavior name='T" + std::to_string(i) + "'><config at='/p'>/s" + std::to_string(i) +
              "</config>";
      for (std::size_t j = (i + 1) % 2; j < count; j += 2) {
        text += "<inhibition>T" +
                std::to_string((i * 7 + j) % count == i ? (i + 1) % count : (i * 7 + j) % count) +
                "</inhibition>";
      }
      text += "</behavior>";
    }
    return draw(load_model(text + "</behaviors>"), View::kBehaviours);
  };
  EXPECT_THAT(tangle(60), HasSubstr("splines=line"));
  EXPECT_THAT(tangle(7), Not(HasSubstr("splines")));
}

TEST(Picture, SaysWhatItIsOf) {
  const auto model = load_model(list_of(3));
  const Page page{"a & b", {"files/a.xml", "model 3 in force"}, 0};
  const std::string dot = draw(model, View::kBehaviours, page);
  EXPECT_THAT(dot, HasSubstr("<B>a &amp; b</B> · behaviours"));
  EXPECT_THAT(dot, HasSubstr("files/a.xml"));
  EXPECT_THAT(dot, HasSubstr("model 3 in force"));
  EXPECT_THAT(draw(model, View::kConnections, page), HasSubstr("</B> · connections"));
}

TEST(Picture, HasTheDotsThatItIsAskedFor) {
  const auto model = load_model(list_of(3));
  EXPECT_THAT(draw(model, View::kBehaviours, {"", {}, 300}), HasSubstr(" dpi=300 "));
  EXPECT_THAT(draw(model, View::kBehaviours), Not(HasSubstr("dpi")));
}

TEST(Picture, HasALegendOfWhatThereIsInIt) {
  const auto inhibits = std::string("red: ") + look_of(LineKind::kInhibits).meaning;
  const auto sensed = std::string("blue: ") + look_of(LineKind::kSensed).meaning;
  const std::string behaviours = draw(load_model(list_of(3)), View::kBehaviours);
  EXPECT_THAT(behaviours, HasSubstr(inhibits));
  EXPECT_THAT(behaviours, Not(HasSubstr(sensed)));
  const std::string connections =
      draw(load_model("<arbiter at='/p'><select from='/a'>not /b</select></arbiter>"),
           View::kConnections);
  EXPECT_THAT(connections, HasSubstr(sensed));
  EXPECT_THAT(connections, Not(HasSubstr(inhibits)));
  const Situation situation = decide(load_model(list_of(3)).rules, {"/s1"});
  EXPECT_THAT(draw(load_model(list_of(3)), View::kBehaviours, {}, &situation),
              HasSubstr(look_of(MarkKind::kRuns).meaning));
}

TEST(Picture, SaysFromWhichHostASourceComes) {
  const auto model = load_model("<arbiter at='/p'><select from='/a'>not /b</select></arbiter>");
  Situation situation = decide(model.rules, {"/a"});
  EXPECT_THAT(draw(model, View::kConnections, {}, &situation), Not(HasSubstr("(host ")));
  situation.hosts["/b"] = "head";
  const std::string dot = draw(model, View::kConnections, {}, &situation);
  EXPECT_THAT(dot, HasSubstr("/b (host head)"));
  EXPECT_THAT(dot, Not(HasSubstr("/a (host")));
}

TEST(Picture, ShortensWhatIsLongAndHasItAllInTheTooltip) {
  const std::string name = "Begin " + std::string(80, 'x') + " End";
  const std::string port = "/" + std::string(80, 'y') + "/pos:i";
  const std::string dot = draw(load_model("<behaviors><behavior name='" + name + "'><config at='" +
                                          port + "'>/s</config></behavior></behaviors>"),
                               View::kBehaviours);
  EXPECT_EQ(count(dot, name), 1u);
  EXPECT_THAT(dot, HasSubstr("tooltip=\"" + name));
  EXPECT_THAT(dot, HasSubstr("/s → " + port));
  EXPECT_THAT(dot, HasSubstr(" End</B>"));
}

// Each arbiter of a large model has its own sources beside it, so that no arrow crosses another.
TEST(Picture, OfManyConnectionsIsOneOfEachPort) {
  const Drawable model = make_model(40, 0.3, false, 5);
  for (const std::string& line : lines_of(draw(model.loaded, View::kConnections))) {
    std::smatch ends;
    static const std::regex kArrow(R"(^s(\d+):.* -> p(\d+):)");
    if (line.find(" -> ") == std::string::npos || line.find("style=invis") != std::string::npos) {
      continue;
    }
    ASSERT_TRUE(std::regex_search(line, ends, kArrow)) << line;
    EXPECT_EQ(ends[1], ends[2]);
  }
}

// Where a text names a colour, the lines have it: the page, the legend and the help have all they
// say from one table.
TEST(Look, IsWhatTheDocumentationSays) {
  const std::string page = test::content_of(ARBITER_SOURCE "/docs/models.md");
  for (const Line& line : kLines) {
    EXPECT_THAT(page, HasSubstr(std::string("| ") + line.word + " | " + line.meaning + " |"));
    EXPECT_THAT(legend_in_words(), HasSubstr(std::string(line.word) + ": " + line.meaning));
  }
  for (const Sign& sign : kSigns) {
    EXPECT_THAT(page, HasSubstr(std::string("| ") + sign.text + " | " + sign.meaning + " |"));
  }
  for (const Mark& mark : kMarks) {
    EXPECT_THAT(page, HasSubstr(std::string("| ") + mark.sign + " " + mark.word + " | " +
                                mark.meaning + " |"));
  }
}

struct Rgb {
  int red, green, blue;
};

Rgb rgb_of(const std::string& colour) {
  return {std::stoi(colour.substr(1, 2), nullptr, 16), std::stoi(colour.substr(3, 2), nullptr, 16),
          std::stoi(colour.substr(5, 2), nullptr, 16)};
}

// A reader who is told of a red arrow must not find an orange one.
TEST(Look, HasTheColoursThatItNames) {
  for (const Line& line : kLines) {
    const auto [red, green, blue] = rgb_of(line.colour);
    const std::string word = line.word;
    SCOPED_TRACE(word + " " + line.colour);
    const int most = std::max({red, green, blue}), least = std::min({red, green, blue});
    if (word == "black" || word == "grey") {
      EXPECT_EQ(most, least);
      EXPECT_EQ(word == "black", most < 0x60);
    } else if (word == "red" || word == "pale red") {
      EXPECT_EQ(most, red);
      EXPECT_LT(std::abs(green - blue), (red - least) / 4);
      EXPECT_EQ(word == "pale red", least > 0x80);
    } else if (word == "orange") {
      EXPECT_EQ(most, red);
      EXPECT_GT(green - blue, (red - blue) / 2);
    } else if (word == "green") {
      EXPECT_EQ(most, green);
    } else {
      EXPECT_EQ(word, "blue");
      EXPECT_EQ(most, blue);
    }
  }
}

// Nothing is said by colour alone: in one picture, no two lines differ in nothing else.
TEST(Look, DiffersInMoreThanColour) {
  for (const std::set<LineKind>& together :
       {std::set{LineKind::kInhibits, LineKind::kInhibitsPast, LineKind::kSelected,
                 LineKind::kSensed, LineKind::kWithoutRule},
        std::set{LineKind::kWins, LineKind::kOverridden, LineKind::kInactive, LineKind::kSensed,
                 LineKind::kWithoutRule}}) {
    std::set<std::string> looks;
    for (const LineKind kind : together) {
      const Line& line = look_of(kind);
      EXPECT_EQ(line.kind, kind);
      EXPECT_TRUE(looks.insert(std::string(line.width) + line.style + line.head).second)
          << line.meaning;
    }
  }
}

}  // namespace
}  // namespace arbiter::drawing
