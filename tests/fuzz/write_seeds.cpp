// Writes the seeds of one target into a folder: castor_fuzz_seeds TARGET FOLDER.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "fuzz/targets.h"

int main(int argc, char** argv) {
    if (argc != 3) {
        std::cerr << "castor_fuzz_seeds TARGET FOLDER\n";
        return 2;
    }
    const std::filesystem::path folder = argv[2];
    std::filesystem::create_directories(folder);
    for (const castor::fuzz::Target& target : castor::fuzz::targets()) {
        if (argv[1] != std::string_view(target.name)) continue;
        int number = 0;
        for (const std::string& seed : target.seeds())
            std::ofstream(folder / ("seed" + std::to_string(number++)), std::ios::binary) << seed;
        return 0;
    }
    std::cerr << "there is no target " << argv[1] << '\n';
    return 2;
}
