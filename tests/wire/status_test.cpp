// The status document: each field there and back, and documents that are not what they should be.
#include "wire/status.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/wire/full_status.hpp"
#include "wire/document.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using wire::DocumentError;
using wire::Status;

json there_and_back(const json& document) { return to_json(wire::read_status(document.dump())); }

std::string refusal_of(const std::string& text) {
  try {
    static_cast<void>(wire::read_status(text));
  } catch (const DocumentError& error) {
    return error.what();
  }
  return "read";
}

// "/sources/0/type/size" -> "sources[0].type.size"
std::string path_of(const json::json_pointer& pointer) {
  std::string path;
  for (json::json_pointer rest = pointer; !rest.empty(); rest.pop_back()) {
    const std::string part = rest.back();
    const bool is_index = part.find_first_not_of("0123456789") == std::string::npos;
    path = (is_index ? "[" + part + "]" : "." + part) + path;
  }
  return path.substr(1);
}

// Each value of the document that is none of others.
std::vector<json::json_pointer> leaves() {
  std::vector<json::json_pointer> result;
  const json whole = to_json(full_status());
  const json flat = whole.flatten();
  for (const auto& item : flat.items()) {
    const json::json_pointer leaf(item.key());
    if (!whole[leaf].is_structured()) result.push_back(leaf);  // else it is empty
  }
  return result;
}

bool ends_with(const json::json_pointer& pointer, const std::set<std::string>& keys) {
  return keys.contains(pointer.back());
}

const std::set<std::string> kCounters{
    "reloads_refused", "published", "signals",   "delivered", "discarded",  "refused",
    "blind",           "unsettled", "no_slot",   "late",      "misbehaved", "idles",
    "taken",           "dropped",   "overtaken", "accepted",  "waiting"};

TEST(StatusFields, IsReadAsItWasWritten) {
  const json document = to_json(full_status());
  EXPECT_EQ(there_and_back(document), document);
  EXPECT_EQ(to_json(Status()), there_and_back(to_json(Status())));
}

// Whatever is changed in the document, the type has it.
TEST(StatusFields, HasEachFieldOfTheDocument) {
  const json whole = to_json(full_status());
  ASSERT_GT(leaves().size(), 130u);
  for (const auto& leaf : leaves()) {
    // One of several words; what others say.
    if (ends_with(leaf, {"state", "when_full", "away", "open", "mismatch"})) continue;
    json document = whole;
    json& value = document[leaf];
    if (value.is_boolean()) {
      value = !value.get<bool>();
    } else if (value.is_number()) {
      value = value.get<std::int64_t>() + 1;
    } else if (value.is_null() && leaf.back() == "type") {
      value = {{"name", "T"}, {"size", 1}, {"alignment", 1}};
    } else if (value.is_null() && leaf.back() == "cannot_deliver") {
      value = {{"source", "/s"}, {"why", "so"}};
    } else if (value.is_null() && leaf.back() == "away_pid") {
      value = 99;
      document[leaf.parent_pointer() / "away"] = true;
    } else if (value == "forever") {
      value = 7;
    } else {
      value = "another";
    }
    EXPECT_EQ(there_and_back(document), document) << leaf;
  }
}

TEST(StatusFields, SaysWhichFieldHasAnotherTypeThanItMust) {
  const json whole = to_json(full_status());
  for (const auto& leaf : leaves()) {
    if (ends_with(leaf, {"away"})) continue;  // away_pid says it too
    for (const json& wrong : {json(1.5), json::array({1}), json::object()}) {
      json document = whole;
      document[leaf] = wrong;
      EXPECT_THAT(refusal_of(document.dump()), HasSubstr("document: " + path_of(leaf)))
          << leaf << " is " << wrong;
    }
  }
}

TEST(StatusFields, WithoutACounterHasNoneCountedAndWithoutAnythingElseIsRefused) {
  const json whole = to_json(full_status());
  for (const auto& leaf : leaves()) {
    const auto parent = leaf.parent_pointer();
    if (!whole[parent].is_object()) continue;
    json document = whole;
    document[parent].erase(leaf.back());
    if (kCounters.contains(leaf.back())) {
      const json read = there_and_back(document);
      EXPECT_EQ(read[leaf], 0) << leaf;
    } else if (leaf.back() == "away" || leaf.back() == "described" || leaf.back() == "trouble" ||
               leaf.back() == "output" || leaf.back() == "input" || leaf.to_string() == "/at_ns" ||
               (leaf.back() == "depth" &&
                leaf.to_string().find("connections") != std::string::npos)) {
      EXPECT_EQ(refusal_of(document.dump()), "read") << leaf;
    } else {
      EXPECT_THAT(refusal_of(document.dump()),
                  HasSubstr(path_of(leaf) + " is missing; are this program and arbiterd of the "
                                            "same version?"));
    }
  }
}

TEST(StatusFields, OfADaemonThatKnowsOfNoRefusalsHasNone) {
  json document = to_json(full_status());
  document.erase("refusals");
  EXPECT_TRUE(wire::read_status(document.dump()).refusals.empty());
}

TEST(StatusFields, PassesOverWhatALaterVersionAdds) {
  json document = to_json(full_status());
  const json known = document;
  document["new"] = {{"deep", {1, 2, 3}}};
  document["inputs"][0]["connections"][0]["new"] = nullptr;
  EXPECT_EQ(there_and_back(document), known);
}

TEST(StatusFields, RefusesNumbersThatDoNotFit) {
  json document = to_json(full_status());
  document["pid"] = std::int64_t{1} << 31;
  EXPECT_THAT(refusal_of(document.dump()), HasSubstr("pid is 2147483648, which is out of range"));
  document = to_json(full_status());
  document["clients"] = -1;
  EXPECT_THAT(refusal_of(document.dump()), HasSubstr("clients is -1, which is out of range"));
  document = to_json(full_status());
  document["sources"][0]["published"] = -1;
  EXPECT_THAT(refusal_of(document.dump()), HasSubstr("sources[0].published is -1"));
}

TEST(StatusFields, RefusesWordsThatItDoesNotKnow) {
  json document = to_json(full_status());
  document["inputs"][0]["when_full"] = "burst";
  EXPECT_THAT(refusal_of(document.dump()),
              HasSubstr("inputs[0].when_full is \"burst\", which is not known here"));
  document = to_json(full_status());
  document["inputs"][0]["connections"][0]["state"] = "mismatch";
  EXPECT_THAT(refusal_of(document.dump()),
              HasSubstr("inputs[0].connections[0].state does not agree with mismatch"));
}

TEST(StatusFields, NamesEachStateOfAConnection) {
  std::set<std::string> states;
  for (const auto output : {wire::End::kOpen, wire::End::kAway, wire::End::kClosed}) {
    for (const auto input : {wire::End::kOpen, wire::End::kAway, wire::End::kClosed}) {
      Status status = full_status();
      wire::ConnectionStatus& connection = status.inputs[0].connections[0];
      connection.output = output;
      connection.input = input;
      states.insert(connection.state());
      const Status read = wire::read_status(to_json(status).dump());
      EXPECT_EQ(read.inputs[0].connections[0].output, output);
      EXPECT_EQ(read.inputs[0].connections[0].input, input);
    }
  }
  EXPECT_EQ(states.size(), 9u);
}

TEST(StatusFields, ThatIsCutOffIsRefusedWherever) {
  const std::string whole = to_json(full_status()).dump();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_THAT(refusal_of(whole.substr(0, size)), HasSubstr("the daemon's document is not JSON"));
  }
}

TEST(StatusFields, FindsPortsByName) {
  const Status status = full_status();
  EXPECT_EQ(status.find_source("/stop"), &status.sources[1]);
  EXPECT_EQ(status.find_input("/idle"), &status.inputs[1]);
  EXPECT_EQ(status.find_source("/idle"), nullptr);
}

}  // namespace
}  // namespace arbiter::test
