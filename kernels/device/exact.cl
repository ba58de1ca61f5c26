// Division and square root that are correctly rounded on every device.
//
// CASTOR_CORRECTLY_ROUNDED  1 where the device reports CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT and the program is built with
//                           -cl-fp32-correctly-rounded-divide-sqrt
#ifndef CASTOR_CORRECTLY_ROUNDED
#define CASTOR_CORRECTLY_ROUNDED 0
#endif

float divide(const float numerator, const float denominator)
{
    return numerator / denominator;
}

float square_root(const float x)
{
    return sqrt(x);
}
