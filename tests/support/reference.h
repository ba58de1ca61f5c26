#pragma once

namespace castor::reference {}

namespace castor::test {
using namespace castor::reference;  // what the tests share with castor doctor and castor bench
}
