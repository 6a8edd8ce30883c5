// Connections in boxes of hosts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "drawing/dot.hpp"
#include "drawing/drawing.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::drawing {
namespace {

using rules::Folder;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

rules::LoadedModel model_of(const std::string& text) {
  const Folder folder;
  rules::Diagnostics diagnostics;
  auto loaded =
      rules::load_all(rules::read_texts({{folder.write("m.xml", text)}, {}}), diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  return loaded;
}

// What stands in the box of that host, with what is in it; empty: there is no such box.
std::string box_of(const std::string& dot, const std::string& host) {
  const std::size_t name = dot.find("tooltip=\"host " + host + "\"");
  if (name == std::string::npos) return {};
  const std::size_t begin = dot.rfind("  subgraph cluster_h", name);
  return dot.substr(begin, dot.find("\n  }\n", name) - begin);
}

const std::string kOnTwoHosts = R"(<behaviors>
  <behavior name="Hold"><config at="/Motor/speed:i">/Hold/speed:o</config></behavior>
  <behavior name="Drive"><config at="/Motor/speed:i">/Planner/speed:o</config>
    <inhibition>Hold</inhibition></behavior>
  <behavior name="Look"><config at="/Planner/goal:i">/Operator/goal:o</config></behavior>
</behaviors>)";

Places two_hosts() {
  Places places;
  places.boxes["base"].captions = {"this host"};
  places.boxes["head"].captions = {"round trip 0.17 ms"};
  places.sources = {{"/Hold/speed:o", "base"}, {"/Planner/speed:o", "head"}};
  places.ports = {{"/Motor/speed:i", "base"}, {"/Planner/goal:i", "head"}};
  places.notes = {{"/Planner/speed:o", "30 ms ago"}};
  return places;
}

TEST(HostsView, PutsSourcesAndPortsIntoTheBoxesOfTheirHosts) {
  const Places places = two_hosts();
  const std::string dot = draw(model_of(kOnTwoHosts), View::kConnections, {}, nullptr, &places);
  EXPECT_THAT(box_of(dot, "base"),
              AllOf(HasSubstr("<B>base</B>"), HasSubstr("this host"), HasSubstr("▸ /Motor/speed:i"),
                    HasSubstr("/Hold/speed:o ▸"), Not(HasSubstr("tooltip=\"Planner\""))));
  EXPECT_THAT(box_of(dot, "head"),
              AllOf(HasSubstr("round trip 0.17 ms"), HasSubstr("/Planner/speed:o (30 ms ago) ▸"),
                    HasSubstr("▸ /Planner/goal:i"), Not(HasSubstr("tooltip=\"Motor\""))));
  // Nobody knows where it is.
  EXPECT_THAT(dot, HasSubstr("\n  c0 [tooltip=\"Operator\""));
  EXPECT_THAT(dot, HasSubstr(kHostBox));
}

TEST(HostsView, WithoutPlacesThereAreNone) {
  const auto loaded = model_of(kOnTwoHosts);
  const std::string dot = draw(loaded, View::kConnections);
  EXPECT_THAT(dot, AllOf(Not(HasSubstr("cluster_h")), Not(HasSubstr(kHostBox))));
  const Places none;
  EXPECT_EQ(draw(loaded, View::kConnections, {}, nullptr, &none), dot);
}

TEST(HostsView, AComponentThatHasPortsOnTwoStandsOnBoth) {
  Places places = two_hosts();
  places.ports["/Planner/goal:i"] = "base";
  const std::string dot = draw(model_of(kOnTwoHosts), View::kConnections, {}, nullptr, &places);
  EXPECT_THAT(box_of(dot, "base"), HasSubstr("tooltip=\"Planner\""));
  EXPECT_THAT(box_of(dot, "head"), HasSubstr("tooltip=\"Planner\""));
}

// A cut cable: the planner is active on its own host, and the motor's host does not hear it.
TEST(HostsView, EachIsColouredByWhatItKnowsItself) {
  const auto loaded = model_of(kOnTwoHosts);
  const Situation base = decide(loaded.rules, {"/Hold/speed:o"});
  const Situation head = decide(loaded.rules, {"/Planner/speed:o"});
  Places places = two_hosts();
  places.boxes["base"].situation = &base;
  places.boxes["head"].situation = &head;
  std::string dot = draw(loaded, View::kConnections, {}, &base, &places);
  EXPECT_THAT(box_of(dot, "head"), HasSubstr("● /Planner/speed:o"));
  EXPECT_THAT(box_of(dot, "base"),
              AllOf(HasSubstr("▶ /Hold/speed:o"), HasSubstr("○ /Planner/speed:o")));
  places.boxes["head"].situation = nullptr;  // it does not answer
  dot = draw(loaded, View::kConnections, {}, &base, &places);
  EXPECT_THAT(box_of(dot, "head"),
              AllOf(HasSubstr(">/Planner/speed:o"), Not(HasSubstr("●")), Not(HasSubstr("○"))));
}

// So many that each port has its sources beside it: `crossing` of them live on another host.
std::string large(int crossing) {
  std::string text = "<behaviors>";
  Places places;
  places.boxes["base"];
  places.boxes["head"];
  for (int i = 0; i < 40; ++i) {
    const std::string n = std::to_string(i);
    text += "<behavior name='B" + n + "'><config at='/P" + n + "/in:i'>/S" + n +
            "/out:o</config></behavior>";
    places.ports["/P" + n + "/in:i"] = "base";
    places.sources["/S" + n + "/out:o"] = i < crossing ? "head" : "base";
  }
  return draw(model_of(text + "</behaviors>"), View::kConnections, {}, nullptr, &places);
}

TEST(HostsView, OfManyConnectionsFewThatCrossTheNetworkLeadFromBoxToBox) {
  const std::string dot = large(3);
  EXPECT_THAT(box_of(dot, "head"), AllOf(HasSubstr("/S0/out:o ▸"), HasSubstr("/S2/out:o ▸")));
  EXPECT_THAT(box_of(dot, "base"), AllOf(Not(HasSubstr("/S2/out:o ▸")), HasSubstr("/S3/out:o ▸"),
                                         HasSubstr("/P0/in:i")));
}

// Else nobody could follow them.
TEST(HostsView, WhereManyCrossTheNetworkSourcesStandBesideTheirPortsAndNameTheirHosts) {
  const std::string dot = large(30);
  EXPECT_EQ(box_of(dot, "head"), "");
  EXPECT_THAT(box_of(dot, "base"),
              AllOf(HasSubstr("/S29/out:o (host head) ▸"), HasSubstr("/S30/out:o ▸")));
}

// They come from files and from the network.
TEST(HostsView, NamesOfHostsAreOnlyText) {
  const std::string name = "a\"<b>&\\\n";
  Places places = two_hosts();
  places.boxes[name].captions = {"<i>"};
  places.ports["/Motor/speed:i"] = name;
  const std::string dot = draw(model_of(kOnTwoHosts), View::kConnections, {}, nullptr, &places);
  EXPECT_THAT(dot, AllOf(HasSubstr(drawing::quoted("host " + name)),
                         HasSubstr("<B>a&quot;&lt;b&gt;&amp;\\"), HasSubstr("&lt;i&gt;"),
                         Not(HasSubstr("<i>"))));
}

}  // namespace
}  // namespace arbiter::drawing
