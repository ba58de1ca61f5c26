#pragma once

namespace castor::reference {}

namespace castor::test {
using namespace castor::reference;  // references that castor doctor and castor bench use too
}
