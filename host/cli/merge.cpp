// castor merge: joins checkpoints of one picture, or parts of one batch of hits.
#include "castor/merge.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/atomic_file.h"
#include "castor/error.h"
#include "castor/image_io.h"
#include "commands.h"
#include "hits_part.h"
#include "picture_files.h"
#include "ray_file.h"
#include "report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMergeFooter =
    R"(The files are checkpoints of one picture: of its parts (castor render --part), or of renders that were ended
early, in any order and number. Of each block of pixels the file with more samples counts. Where two have equally many
and other bits, the exit status is 4. -o writes the picture, which must be complete unless --incomplete is given;
--checkpoint writes what all files have together, for castor render --resume or another castor merge.

Parts of hits (castor trace --part) become a file of hits, which -o names.

Examples:
  castor merge part1 part2 part3 -o picture.png
  castor merge part* --checkpoint so_far
  castor merge part* -o so_far.png --incomplete
  castor merge hits1 hits2 -o hits.bin)";

struct MergeCommandOptions {
    std::vector<std::string> files;
    std::string output, checkpoint, device;
    bool allows_incomplete = false, has_layers = false;
    ReportOptions report;
};

double percentage(const MergedPicture& picture) {
    return 100.0 * static_cast<double>(picture.samples_done) / static_cast<double>(picture.samples());
}

/// Throws, before the work begins, if a file cannot be written. The checkpoint may replace one of the files.
void check_outputs(const MergeCommandOptions& options, bool are_hits) {
    if (are_hits &&
        (options.output.empty() || !options.checkpoint.empty() || options.allows_incomplete || options.has_layers))
        throw UsageError("parts of hits take -o alone, which names the file of hits");
    if (options.output.empty() && options.checkpoint.empty())
        throw UsageError("-o names a picture to write, and --checkpoint a checkpoint; one of them is needed");
    if (options.output.empty() && options.has_layers)
        throw UsageError("--layers: there is no picture to write; name one by -o");
    for (const std::string& file : options.files) {
        std::error_code ignored;
        if (!options.output.empty() && fs::equivalent(file, options.output, ignored))
            throw UsageError(fmt::format("-o: {} would be overwritten, and it is read", file));
    }
    if (!options.output.empty()) {
        if (!are_hits) check_image_extension(options.output);
        if (options.has_layers) check_layers_extension(options.output);
        check_writable(options.output);
    }
    if (!options.checkpoint.empty()) check_writable(options.checkpoint);
}

ExitStatus run(const MergeCommandOptions& options) {
    const std::vector<fs::path> files(options.files.begin(), options.files.end());
    const bool are_hits = is_hits_part(files.front());
    check_outputs(options, are_hits);
    if (are_hits) {
        const HitsPart whole = merge_hits(files);
        write_answers(options.output, whole.answers);
        const std::string output = fs::absolute(options.output).string();
        if (!options.report.quiet) note("{}: hits of {} rays", output, whole.rays);
        if (options.report.json) print_json({{"files", options.files}, {"rays", whole.rays}, {"file", output}});
        return ExitStatus::done;
    }
    const std::vector<Device> devices =
        options.device.empty() ? std::vector<Device>() : castor::select_devices(options.device);
    const MergedPicture picture = merge_checkpoints(files, options.checkpoint, devices, !options.output.empty());
    const bool is_complete = picture.film.complete();
    const bool writes = !options.output.empty() && (is_complete || options.allows_incomplete);
    FurtherFiles further;
    if (writes) {
        const fs::path output = options.output;
        further =
            write_picture({.file = output, .tone_mapped = name_tone_mapped(output, picture.tone_maps)}, picture.film,
                          picture.rules, options.has_layers ? PlaneFiles::layers : PlaneFiles::beside);
    }
    if (!options.report.quiet)
        note("{} file{}: {:.1f} % of the samples of {}x{} pixels", files.size(), files.size() == 1 ? "" : "s",
             percentage(picture), picture.film.width, picture.film.height);
    if (!options.report.quiet && picture.is_denoised)
        note("noise was removed{}", note_on_denoiser(picture.oidn_version));
    if (options.report.json)
        print_json({{"files", options.files},
                    {"width", picture.film.width},
                    {"height", picture.film.height},
                    {"samples_per_pixel", picture.film.samples_per_pixel},
                    {"samples_done", picture.samples_done},
                    {"samples", picture.samples()},
                    {"complete", is_complete},
                    {"denoised", picture.is_denoised},
                    {"denoiser", picture.is_denoised ? Json(name_of_denoiser(picture.oidn_version)) : Json()},
                    {"file", writes ? Json(fs::absolute(options.output).string()) : Json()},
                    {"tone_mapped", further.tone_mapped},
                    {"planes", further.planes},
                    {"checkpoint", options.checkpoint.empty() ? Json() : Json(options.checkpoint)}});
    if (!options.output.empty() && !writes)
        throw SceneError(options.files.front(), 0,
                         fmt::format("this and the other files have {:.1f} % of the picture's samples: {} is not "
                                     "written. --incomplete writes it all the same",
                                     percentage(picture), options.output));
    return ExitStatus::done;
}

}  // namespace

void add_merge(CLI::App& app, Action& action) {
    CLI::App* command = app.add_subcommand("merge", "Join parts of a picture, or of hits, that several computers made");
    const auto options = std::make_shared<MergeCommandOptions>();
    command
        ->add_option("FILE", options->files,
                     "checkpoints of castor render or castor merge, or parts of hits of castor trace")
        ->required();
    command->add_option("-o,--output", options->output, "picture, or file of hits, to write");
    command->add_option("--checkpoint", options->checkpoint, "checkpoint to write, of all that the files have");
    command->add_option("--device", options->device,
                        "that removes noise, where castor render had --denoise; else the first GPU, else the first "
                        "device");
    command->add_flag("--incomplete", options->allows_incomplete, "write the picture also if samples are missing");
    command->add_flag("--layers", options->has_layers, "write planes into the picture, an .exr, as layers");
    add_report_options(*command, options->report);
    command->footer(kMergeFooter);
    command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace castor::cli
