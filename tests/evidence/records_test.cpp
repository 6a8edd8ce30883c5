// Records, written and read.
#include "evidence/records.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "evidence/record_schemas.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using evidence::Record;
using nlohmann::json;

// One of each kind, with all that a record may have.
void add_everything(Incident& incident) {
  incident.arrive("/low", 1010, 1011, Incident::Fate::accepted);
  Record payload = incident.records().back();
  auto& arrival = std::get<evidence::Arrival>(payload);
  arrival.sequence = 2;
  arrival.time = arrival.seen = 1012;
  arrival.payload = std::vector<std::byte>{std::byte{1}, std::byte{0}, std::byte{255}};
  arrival.word = shm::kForeverFlag | 1012;
  arrival.origin = {0xfedc'ba98'7654'3210, 8841};
  incident.add(payload);
  incident.deactivate("/low", 1020, 1021);
  incident.state("/high", 1030, 1031, shm::deactivation(1030), evidence::SourceState::Why::gap, 4);
  auto context = std::make_shared<evidence::SourceContext>();
  context->source = "/\"odd\"\n/\xC3\xA9";
  context->destinations = {"/p", "/q"};
  incident.add(evidence::DestinationsChange{context, 1040, 1041});
  incident.add(
      evidence::PortChange{evidence::PortChange::What::died, true, "/p", "node", 42, "Type", 1050});
  incident.add(evidence::PortChange{evidence::PortChange::What::opened, false, "/low",
                                    "arbiter-link", 43, "Type", 1051, "head"});
  incident.add(evidence::WinnerChange{"/p", "/low", "", 1010, evidence::WinnerChange::Why::arrival,
                                      "/low", 1});
  incident.add(evidence::Missed{"/low", 1, 2, 3, 4, evidence::Missed::Why::queue, "why"});
}

struct Kept {
  std::vector<Record> records;
  evidence::ReadRecording about;
};

Kept read_all(const std::string& file) {
  Kept kept;
  kept.about = evidence::read_recording(file, evidence::Payloads::read, [&](Record&& record) {
    kept.records.push_back(std::move(record));
  });
  return kept;
}

TEST(Records, AreReadAsTheyWereWritten) {
  Incident incident;
  add_everything(incident);
  const Kept kept = read_all(incident.file());
  EXPECT_EQ(kept.about.instance, "test");
  EXPECT_EQ(kept.about.host, "host");
  EXPECT_EQ(kept.about.wall_offset, 5'000'000);
  ASSERT_EQ(kept.records.size(), incident.records().size());
  // What is written of each is what was written before.
  TemporaryDirectory directory;
  const std::string again = directory.path() + "/again.mcap";
  evidence::RecordWriter writer(again, {}, {});
  for (const Record& record : kept.records) writer.write(record);
  writer.close();
  std::vector<std::string> texts[2];
  const std::string files[2] = {incident.file(), again};
  for (int i = 0; i < 2; ++i) {
    recording::McapVisitor visitor;
    visitor.message = [&](const recording::McapMessage& message) {
      texts[i].emplace_back(reinterpret_cast<const char*>(message.data.data()),
                            message.data.size());
    };
    read_mcap(files[i], visitor);
  }
  EXPECT_EQ(texts[0], texts[1]);
  bool has_payload = false;
  for (const Record& record : kept.records) {
    const auto* arrival = std::get_if<evidence::Arrival>(&record);
    if (arrival == nullptr || !arrival->payload) continue;
    has_payload = true;
    EXPECT_EQ(*arrival->payload,
              (std::vector<std::byte>{std::byte{1}, std::byte{0}, std::byte{255}}));
  }
  EXPECT_TRUE(has_payload);
}

TEST(Records, AreOrderedByWallTimeThroughTheOffset) {
  Incident incident;
  add_everything(incident);
  std::set<std::uint64_t> times;
  recording::McapVisitor visitor;
  visitor.message = [&](const recording::McapMessage& message) { times.insert(message.log_time); };
  read_mcap(incident.file(), visitor);
  EXPECT_TRUE(times.count(5'001'010) != 0);
}

// As far as our schemas go.
void expect_fits(const json& value, const json& schema, const std::string& where) {
  const std::string type = schema["type"];
  if (type == "object") {
    ASSERT_TRUE(value.is_object()) << where;
    EXPECT_EQ(schema["additionalProperties"], false) << where;
    for (const auto& name : schema["required"]) {
      EXPECT_TRUE(value.contains(name.get<std::string>())) << where << '.' << name;
    }
    for (const auto& [name, each] : value.items()) {
      ASSERT_TRUE(schema["properties"].contains(name)) << where << '.' << name;
      expect_fits(each, schema["properties"][name], where + '.' + name);
    }
  } else if (type == "array") {
    ASSERT_TRUE(value.is_array()) << where;
    for (const auto& each : value) expect_fits(each, schema["items"], where + "[]");
  } else if (type == "integer") {
    EXPECT_TRUE(value.is_number_integer() && value >= schema["minimum"]) << where;
  } else if (type == "boolean") {
    EXPECT_TRUE(value.is_boolean()) << where;
  } else {
    ASSERT_EQ(type, "string") << where;
    EXPECT_TRUE(value.is_string()) << where;
    if (!schema.contains("enum")) return;
    const json& words = schema["enum"];
    EXPECT_TRUE(std::find(words.begin(), words.end(), value) != words.end()) << where << value;
  }
}

// That nobody has told of a type is another thing than that there is none.
TEST(Records, OfStatesLeaveOutWhatIsNotKnown) {
  Incident incident;
  for (const bool is_described : {false, true}) {
    auto context = std::make_shared<evidence::SourceContext>();
    context->source = is_described ? "/untyped" : "/unknown";
    context->is_described = is_described;
    evidence::SourceState state;
    state.context = std::move(context);
    incident.add(state);
  }
  std::map<std::string, json> written;
  recording::McapVisitor visitor;
  visitor.message = [&](const recording::McapMessage& message) {
    const auto* text = reinterpret_cast<const char*>(message.data.data());
    const json record = json::parse(text, text + message.data.size());
    written[record.value("source", "")] = record;
  };
  read_mcap(incident.file(), visitor);
  EXPECT_EQ(written["/untyped"]["type"], "");
  for (const char* name : {"type", "type_size", "type_alignment", "destinations"}) {
    EXPECT_TRUE(written["/untyped"].contains(name)) << name;
    EXPECT_FALSE(written["/unknown"].contains(name)) << name;
  }
  for (const Record& record : read_all(incident.file()).records) {
    const auto* context = evidence::context_of(record);
    if (context == nullptr) continue;
    EXPECT_EQ(context->is_described, context->source != "/unknown") << context->source;
  }
}

TEST(Records, FitTheSchemasInTheFile) {
  Incident incident;
  add_everything(incident);
  std::map<std::uint16_t, json> schemas;
  std::map<std::uint16_t, std::pair<std::string, std::uint16_t>> channels;
  std::set<std::string> seen;
  recording::McapVisitor visitor;
  visitor.schema = [&](std::uint16_t id, const recording::McapSchema& schema) {
    if (schema.encoding == "jsonschema") schemas[id] = json::parse(schema.data);
  };
  visitor.channel = [&](std::uint16_t id, const recording::McapChannel& channel) {
    channels[id] = {channel.topic, channel.message_encoding == "json" ? channel.schema : 0};
  };
  visitor.message = [&](const recording::McapMessage& message) {
    const auto& [topic, schema] = channels.at(message.channel);
    if (schema == 0) return;
    const auto* text = reinterpret_cast<const char*>(message.data.data());
    expect_fits(json::parse(text, text + message.data.size()), schemas.at(schema), topic);
    seen.insert(topic);
  };
  read_mcap(incident.file(), visitor);
  EXPECT_EQ(seen.size(), evidence::kRecordKinds);
}

TEST(Records, HaveEachFieldOnTheirPage) {
  const std::string page = content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/recording.md");
  for (const auto& schema : evidence::record_schemas) {
    const auto row = page.find("| `" + std::string(schema.topic) + "` |");
    ASSERT_NE(row, std::string::npos) << schema.topic;
    const std::string text = page.substr(row, page.find('\n', row) - row);
    const json properties = json::parse(schema.json())["properties"];
    for (const auto& [name, type] : properties.items()) {
      EXPECT_NE(text.find('`' + name + '`'), std::string::npos) << schema.topic << ": " << name;
    }
  }
}

// A file with one record, as somebody else might make it.
std::string file_with(const TemporaryDirectory& directory, const std::string& topic,
                      const std::string& text) {
  static int number = 0;
  const std::string path = directory.path() + "/" + std::to_string(++number) + ".mcap";
  recording::McapWriter file(path, "test", {});
  file.write_metadata("arbiter.recording", {{"format", "1"}});
  const auto schema = file.add_schema({"x", "jsonschema", "{}"});
  const auto channel = file.add_channel({schema, topic, "json", {}});
  file.write({channel, 0, 0, 0, std::as_bytes(std::span(text))});
  file.close();
  return path;
}

std::string error_of_reading(const std::string& file) {
  try {
    static_cast<void>(evidence::load_recording(file));
  } catch (const evidence::RecordError& error) {
    return error.what();
  }
  return "none";
}

TEST(Records, ThatNobodyCouldHaveWrittenAreRefused) {
  const TemporaryDirectory directory;
  const auto error = [&](const std::string& topic, const std::string& text) {
    const std::string file = file_with(directory, topic, text);
    const std::string what = error_of_reading(file);
    return what.substr(std::min(what.size(), file.size()));
  };
  EXPECT_EQ(error("arbiter/missed", "{"),
            ": record 1, of topic arbiter/missed: it is not a JSON object");
  EXPECT_EQ(error("arbiter/start", R"({"time_ns":-1})"),
            ": record 1, of topic arbiter/start: its field \"time_ns\" is not a whole number of at "
            "least 0");
  EXPECT_EQ(error("arbiter/start", R"({"time_ns":9223372036854775807})"),
            ": record 1, of topic arbiter/start: its field \"time_ns\" is not a time");
  EXPECT_EQ(error("arbiter/deactivation", R"({"source":7})"),
            ": record 1, of topic arbiter/deactivation: its field \"source\" is not a text");
}

// Parsing makes many times as much memory of a text.
TEST(Records, ThatWouldTakeMuchMemoryAreNotParsed) {
  const TemporaryDirectory directory;
  const auto error = [&](const std::string& topic, const std::string& text) {
    const std::string what = error_of_reading(file_with(directory, topic, text));
    return what.substr(what.rfind(": ") + 2);
  };
  std::string lists = "{\"files\":[";
  for (int i = 0; i < 70'000; ++i) lists += "[],";
  lists += "[]]}";
  EXPECT_EQ(error("arbiter/missed", std::string(1'048'577, ' ')),
            "it has 1048577 bytes, more than the 1048576 that it may have");
  EXPECT_EQ(error("arbiter/model", std::string(67'108'865, ' ')),
            "it has 67108865 bytes, more than the 67108864 that it may have");
  EXPECT_EQ(error("arbiter/model", lists), "it has more than 65536 parts");
  EXPECT_EQ(error("arbiter/missed", std::string(1'048'576, ' ')), "it is not a JSON object");
  EXPECT_EQ(error("arbiter/model", std::string(1'048'577, ' ')), "it is not a JSON object");
}

TEST(Records, ThatNobodyWouldReadAreNotWritten) {
  const TemporaryDirectory directory;
  evidence::RecordWriter writer(directory.file("new.mcap"), {}, {});
  const std::vector<std::string> ports(5'000, std::string(250, 'p'));
  EXPECT_THROW(writer.write(evidence::Start{1'000, "test", ports, "none"}), recording::McapError);
  writer.write(evidence::Start{1'000, "test", {}, "none"});
  writer.close();
  EXPECT_EQ(read_all(directory.file("new.mcap")).records.size(), 1u);
}

// All destinations that there may be, with the longest names, of characters that JSON makes long.
TEST(Records, MayBeAsLargeAsAnyThatIsRecorded) {
  Incident incident;
  auto context = std::make_shared<evidence::SourceContext>();
  context->source = "/low";
  for (char port = 0; port < 64; ++port) {
    context->destinations.push_back(std::string(254, '\x1f') + static_cast<char>('0' + port));
  }
  incident.add(evidence::DestinationsChange{context, 1040, 1041});
  evidence::Arrival arrival;
  arrival.context = context;
  arrival.time = arrival.seen = 1050;
  const std::uint64_t all = ~std::uint64_t{0};
  arrival.masks = {all, all, all, all};
  incident.add(arrival);
  EXPECT_NO_THROW(static_cast<void>(incident.read()));
}

// A later version may know more reasons.
TEST(Records, OfWhatIsMissingAreReadWhateverTheReason) {
  const TemporaryDirectory directory;
  const auto why_of = [&](const std::string& word) {
    const std::string file = file_with(
        directory, "arbiter/missed",
        R"({"source":"/low","from_ns":1,"to_ns":2,"events":0,"samples":3,"text":"","why":")" +
            word + "\"}");
    const auto& missed = std::get<evidence::Missed>(read_all(file).records.at(0));
    EXPECT_EQ(missed.samples, 3u);
    return missed.why;
  };
  for (const auto why : {evidence::Missed::Why::overtaken, evidence::Missed::Why::queue,
                         evidence::Missed::Why::refused, evidence::Missed::Why::stranger,
                         evidence::Missed::Why::too_large, evidence::Missed::Why::memory}) {
    EXPECT_EQ(why_of(std::string(name_of(why))), why);
  }
  EXPECT_EQ(why_of("eaten"), evidence::Missed::Why::other);
}

// What was typed, for example, may be any bytes.
TEST(Records, AreReadableWhateverTheirTextsAre) {
  Incident incident;
  incident.add(evidence::Missed{"/low", 1, 2, 3, 4, evidence::Missed::Why::refused,
                                "\xff\xc3\xa9\xe2\x82\"\x80\n"});
  const auto records = read_all(incident.file()).records;
  ASSERT_EQ(records.size(), incident.records().size());
  EXPECT_EQ(std::get<evidence::Missed>(records.back()).text,
            "\xef\xbf\xbd\xc3\xa9\xef\xbf\xbd\xef\xbf\xbd\"\xef\xbf\xbd\n");
}

TEST(Records, StandInTheFileByATimeThatAClockMayShow) {
  Incident incident;
  incident.add(evidence::Missed{"/low", 1, std::numeric_limits<shm::Nanoseconds>::max(), 3, 4,
                                evidence::Missed::Why::queue, ""});
  std::uint64_t latest = 0;
  recording::McapVisitor visitor;
  visitor.message = [&](const recording::McapMessage& message) {
    latest = std::max(latest, message.log_time);
  };
  read_mcap(incident.file(), visitor);
  EXPECT_EQ(latest, static_cast<std::uint64_t>(shm::kMaxTime) + 5'000'000);
}

// To be added to times that may be as late as there are any.
TEST(Records, AreNoFurtherFromTheWallClockThanTimesMayBe) {
  const TemporaryDirectory directory;
  const auto error = [&](const std::string& offset) {
    const std::string path = directory.path() + "/" + offset + ".mcap";
    recording::McapWriter file(path, "test", {});
    file.write_metadata("arbiter.recording", {{"format", "1"}, {"wall_offset_ns", offset}});
    file.close();
    const std::string what = error_of_reading(path);
    return what.substr(std::min(what.size(), path.size()));
  };
  const std::string refused = " does not say how far its times are from those of the wall clock";
  for (const char* offset : {"9223372036854775807", "-9223372036854775808", "4611686018427387904",
                             "99999999999999999999", "later", "1s"}) {
    EXPECT_EQ(error(offset), refused) << offset;
  }
  for (const char* offset : {"0", "-5", "1790000000000000000"}) EXPECT_EQ(error(offset), "");
}

TEST(Records, AreThoseOfARecording) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/other.mcap";
  recording::McapWriter file(path, "test", {});
  file.close();
  EXPECT_EQ(error_of_reading(path), path + " is not a recording that arbiter has made");
  const std::string empty = directory.write("empty.mcap", "");
  EXPECT_EQ(error_of_reading(empty), empty +
                                         " is not a recording that arbiter has made; at byte "
                                         "0, the beginning of the file: the file is empty");
}

}  // namespace
}  // namespace arbiter::test
